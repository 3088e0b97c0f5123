"""A design that SDSS-V observed, on its own calibrated array, whose positioners are obstacles where they cannot move.

The margin is the 0.8 mm that the design keeps: its goals come within 0.97 mm of each other. Goals that something at
rest touches, which only offline arms do here, are dropped.
"""

from functools import cache
from pathlib import Path

import numpy as np

import fiberplan as fp
from fiberplan.scenes.uniform import uniform_field
from scenes.scene import Scene

ARRAY = "sdss/apo/wok_calibs/sloanFlatCMM"
DESIGN = "sdss/jaeger_test_design/confSummary-test.par"
MARGIN = 0.8  # [mm]
OFFLINE = 10
MOST_BENT = np.radians(90.0)  # an extended arm's beta is anything from straight to this


@cache
def array(data: Path) -> fp.FocalPlane:
    return fp.FocalPlane.load(data / ARRAY)


@cache
def design(data: Path) -> fp.Targets:
    return fp.Targets.read(data / DESIGN)


def absent(data: Path) -> np.ndarray:
    """(n,) positioners of which the design does not say where they were: ten."""
    plane, out = array(data), np.zeros(array(data).n, bool)
    out[[plane.index[id_] for id_ in design(data).offline]] = True
    return out


def from_folded(seed: int, data: Path) -> fp.Problem:
    """A real design of SDSS-V from folded; ten are offline, folded."""
    return fp.Problem.from_targets(array(data), design(data), margin=MARGIN, conflicts="drop")


def offline_folded(seed: int, data: Path) -> fp.Problem:
    """A real design of SDSS-V from a uniform field; ten are offline, folded."""
    plane = array(data).replace(online=~absent(data))
    start = uniform_field(plane, seed, MARGIN)
    return fp.Problem.from_targets(array(data), design(data), start, MARGIN, conflicts="drop")


def offline_extended(seed: int, data: Path) -> fp.Problem:
    """A real design of SDSS-V from a uniform field; ten drawn at random are offline, extended any way.

    Those of which the design says nothing can move and have no target, unless they are drawn.
    """
    rng = np.random.default_rng(seed)
    plane = array(data)
    online = np.ones(plane.n, bool)
    online[rng.choice(plane.n, OFFLINE, replace=False)] = False
    where = plane.folded.copy()
    where[~online, 0] = rng.uniform(plane.lower[~online, 0], plane.upper[~online, 0])
    where[~online, 1] = rng.uniform(0.0, MOST_BENT, OFFLINE)
    plane = plane.replace(online=online)
    start = uniform_field(plane, seed, MARGIN, start=where)
    return fp.Problem(plane, start, design(data).solve(plane).goal, MARGIN, conflicts="drop")


SCENES = (
    Scene("sdss-from-folded", from_folded, fields=1, finite=True, needs=DESIGN),
    Scene("sdss-offline-folded", offline_folded, needs=DESIGN),
    Scene("sdss-offline-extended", offline_extended, needs=DESIGN),
)
