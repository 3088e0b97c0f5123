"""The prototype's own cases of MOONS, from the datum: those of Tao2018, whose arrivals and times are published."""

from functools import cache, partial
from pathlib import Path

import fiberplan as fp
from scenes.scene import Scene

SIZES = (250, 500, 1006)
CASES = 3


@cache
def array(data: Path, size: int) -> fp.FocalPlane:
    return fp.FocalPlane.load(data / f"moons/{size}/positioners.cfg")


def from_datum(seed: int, data: Path, size: int) -> fp.Problem:
    """Case seed + 1 of the MOONS prototype, from the datum; goals that touch are dropped."""
    targets = fp.Targets.read(data / f"moons/{size}/targets_{seed + 1}.txt")
    return fp.Problem.from_targets(array(data, size), targets, conflicts="drop")


def _scene(size: int) -> Scene:
    make = partial(from_datum, size=size)
    make.__doc__ = from_datum.__doc__
    return Scene(f"moons-{size}", make, fields=CASES, finite=True, needs=f"moons/{size}/targets_{CASES}.txt")


SCENES = tuple(_scene(size) for size in SIZES)
