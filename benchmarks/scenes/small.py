"""The smallest decisive scenes: a planner that cannot do these does not do what its table says."""

from collections.abc import Callable
from pathlib import Path

import fiberplan as fp
from fiberplan.scenes import decisive
from fiberplan.scenes.uniform import uniform_field
from scenes.scene import Scene, margin_of


def hexagon_61(seed: int, data: Path) -> fp.Problem:
    """61 arms from field to field at a buffer of 2.0 mm: field 2 seed to field 2 seed + 1."""
    plane, margin = fp.FocalPlane.hexagonal(4, decisive.PITCH), margin_of(2.0)
    start, goal = (uniform_field(plane, number, margin) for number in (2 * seed, 2 * seed + 1))
    return fp.Problem(plane, start, goal, margin)


def _only(problem: Callable[[], fp.Problem]) -> Scene:
    """The scene that is one problem, whatever the seed."""

    def make(seed: int, data: Path) -> fp.Problem:
        return problem()

    make.__doc__ = problem.__doc__
    return Scene(problem.__name__, make, fields=1, finite=True, quick=True)


def offline_across(seed: int, data: Path) -> fp.Problem:
    return decisive.offline_across(seed)


offline_across.__doc__ = decisive.offline_across.__doc__

SCENES = (
    _only(decisive.exchange),
    _only(decisive.pinwheel),
    _only(decisive.aside),
    Scene("offline-across", offline_across, quick=True),
    Scene("hexagon-61", hexagon_61, quick=True),
)
