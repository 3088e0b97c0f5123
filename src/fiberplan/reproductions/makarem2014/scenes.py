"""Seeded scenes: everything that is measured can be made again from the names here, failures included."""

from dataclasses import dataclass

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.inverse_kinematics import solutions
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.problem import Problem
from fiberplan.problem.resting import place_the_rest
from fiberplan.scenes.clustered import clustered_targets
from fiberplan.scenes.uniform import uniform_field
from fiberplan.tolerances import EQUALITY

TRIANGLE = ((0.0, 0.0), (10.0, 0.0), (5.0, 8.660254037844386))  #: bases of Fig. 7 [mm]
AROUND = 3.5  #: [mm] how far from that point
APART = 2.7  #: [mm] starts and goals, so that the printed field can settle
FIG7_SEED = 94  #: the first scene in which all converge and one makes room (`conflict.find_conflict`)


def array(rings: int) -> FocalPlane:
    """A filled hexagon of makarem2014's positioners."""
    whole = FocalPlane.load("makarem2014")
    joints = {name: getattr(whole, name)[0] for name in ("lower", "upper", "folded", "max_speed")}
    return FocalPlane.hexagonal(
        rings, 10.0, (float(whole.length[0]), float(whole.fiber[0, 0])), bodies=whole.bodies, **joints
    )


def three() -> FocalPlane:
    """Three positioners in a triangle."""
    return array(1).subset(np.arange(3)).replace(ids=("A", "B", "C"), base=np.array(TRIANGLE))


def either_parity(plane: FocalPlane, start: np.ndarray, goal: np.ndarray) -> Problem:
    """Go from `start` to where the fibers are at `goal`, both (n, 2) [rad], on either elbow side."""
    found = solutions(plane, np.arange(plane.n), plane.fibers(goal), plane.fiber, np.zeros(plane.n))
    return Problem(plane, start, found[:, 0], alternatives=found[:, 1:])


def crowded_three(seed: int) -> Problem:
    """Three that start and end around the one point which all of them reach."""
    plane, rng = three(), np.random.default_rng([seed, 7])
    middle = plane.base.mean(axis=0)

    def around() -> np.ndarray:
        while True:
            r, phi = AROUND * np.sqrt(rng.random(3)), 2 * np.pi * rng.random(3)
            points = middle + np.stack([r * np.cos(phi), r * np.sin(phi)], axis=1)
            found = solutions(plane, np.arange(3), points, plane.fiber, np.zeros(3))[:, 0]
            apart = np.hypot(*(points - np.roll(points, 1, axis=0)).T).min()
            if np.isfinite(found).all() and apart > APART:
                return found

    return either_parity(plane, around(), around())


def uniform(plane: FocalPlane, seed: int, margin: float = 0.0) -> Problem:
    """From one random field to another, in both of which fibers are at least d + `margin` [mm] apart."""
    start, goal = (uniform_field(plane, 2 * seed + k, margin) for k in (0, 1))
    return either_parity(plane, start, goal)


def clustered(plane: FocalPlane, count: int) -> list[Problem]:
    """`count` moves along a chain of clustered fields, each from the last one's goals."""
    near = Neighbourhood.of(plane, 0.0)
    fields = []
    for seed in range(count + 1):
        asked = Problem.from_targets(plane, clustered_targets(plane, seed), conflicts="drop")
        standing, nowhere = place_the_rest(plane, asked.goal, plane.folded, near, EQUALITY)
        if len(nowhere):
            raise RuntimeError(f"clustered field {seed}: no place to rest for {len(nowhere)} positioners")
        fields.append((asked, standing))
    return [
        Problem(plane, fields[k][1], fields[k + 1][0].goal, alternatives=fields[k + 1][0].alternatives)
        for k in range(count)
    ]


@dataclass(frozen=True)
class Failure:
    """A run that left someone behind, by what makes it again."""

    field: str  #: "uniform" or "clustered"
    rings: int
    seed: int  #: of the field, or place in the chain
    rule: str
    positioners: tuple[str, ...]  #: who did not arrive
