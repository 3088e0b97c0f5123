"""Small scenes: five positioners of which one leaves its target and comes back, and two of which one goes first."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.plan import Outcome, Plan
from fiberplan.planners import EllipticNavigationFunction
from fiberplan.problem import Problem
from fiberplan.reproductions.makarem2016.runs import planned
from fiberplan.reproductions.rows import Row, share, value
from fiberplan.scenes.uniform import uniform_field

SEED = 535  #: of the targets of the five
AT_TARGET = 0.2  #: a fiber this near to its target has come to it [mm]
SPREAD = 0.5  #: of zone sizes, where two arms show who goes first
_SAMPLES = 600


class Five(NamedTuple):
    """The scene, and the one that leaves its target."""

    plan: Plan
    who: int
    times: np.ndarray  #: (k,) [s]
    away: np.ndarray  #: (k, 5) fibers from their targets [mm]
    came: float  #: when it first was at its target [s]
    farthest: float  #: how far it left that again [mm]
    when: float  #: and when [s]


def neighbours(count: int) -> FocalPlane:
    """The `count` positioners nearest to the middle of the paper's array."""
    plane = FocalPlane.load("makarem2016")
    who = np.argsort(np.round(np.hypot(*(plane.base - plane.base.mean(axis=0)).T), 6), kind="stable")[:count]
    return plane.subset(who)


def five() -> Five:
    """Five from the datum to their targets, by the field alone."""
    plane = neighbours(5)
    goal = uniform_field(plane, SEED)
    plan, _ = planned(Problem(plane, plane.folded, goal), "alone")
    times = np.linspace(0.0, plan.makespan, _SAMPLES)
    away = np.array([np.hypot(*(plane.fibers(plan.trajectory.at(t)) - plane.fibers(goal)).T) for t in times])
    came = np.argmax(away < AT_TARGET, axis=0)
    left = np.where(np.arange(_SAMPLES)[:, None] >= came, away, 0.0)
    who = int(np.argmax(left.max(axis=0)))
    k = int(np.argmax(left[:, who]))
    return Five(plan, who, times, away, float(times[came[who]]), float(left[k, who]), float(times[k]))


def rows(scene: Five) -> Iterator[Row]:
    """What the five did."""
    plan = scene.plan
    yield value("five positioners: arrived", 5.0, float(len(plan.having(Outcome.ARRIVED))), 1)
    yield value("five positioners: contacts", 0.0, float(len(plan.certificate.contacts)), 1)
    yield value("five positioners: one comes to its target after [s]", None, scene.came, 1)
    yield value("five positioners: it leaves it by [mm]", "leaves it", scene.farthest, 1)
    yield value("five positioners: and is back at the end, off by [mm]", "comes back", scene.away[-1, scene.who], 1)


def two_arms(trials: int) -> Iterator[Row]:
    """Of two from the datum that cannot both go straight: does the one with the smaller zones arrive first?"""
    plane = neighbours(2)
    first, flipped = [], []
    for seed in range(20 * trials):
        goal = uniform_field(plane, seed)
        straight = (np.abs(goal - plane.folded) / plane.max_speed).max(axis=1)
        ends = []
        for small in (0, 1):
            priority = np.ones(2)
            priority[small] = 2.0
            planner = EllipticNavigationFunction(relief="none", spread=SPREAD)
            plan = planner.plan(Problem(plane, plane.folded, goal, priority=priority))
            motion = plan.trajectory
            ends.append(motion.times[motion.offsets[1:] - 1] if not len(plan.lost) else np.full(2, np.nan))
        if np.isnan(ends).any() or max(np.max(end - straight) for end in ends) < 1.0:
            continue  # nobody had to make room
        late = [end - straight for end in ends]
        first += [bool(late[small][small] < late[small][1 - small]) for small in (0, 1)]
        flipped.append(first[-1] and first[-2])
    yield share("two arms in each other's way: the smaller zone is held up less", "goes first", first)
    yield share("two arms in each other's way: changing the sizes changes that", "goes first", flipped)
