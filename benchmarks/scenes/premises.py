"""Trials of what nights begin with: each is a function of a seed and the folder of real data.

Unless they say otherwise, arrays are hexagons of 61 to 127 arms, and every fifth is the built-in `sdss`.
"""

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

import fiberplan as fp
from fiberplan.errors import FiberplanError
from fiberplan.instruments import desi
from fiberplan.kernels.depth import signed_clearances
from fiberplan.scenes.decisive import PITCH
from fiberplan.scenes.uniform import uniform_field
from runs import warm
from scenes import sdss
from scenes.sdss import ARRAY, DESIGN

DESI = "desi/fp-20260219.ecsv"
OTHER_SITE = "sdss/lco/wok_calibs/duPontFlatCMM"
MARGIN = 0.8  # [mm] where an instrument recommends none; DESI's outlines are expanded already
FIELDS = 10  # of a chain
UNCHECKED = 0.05  # part of a chain's targets that may touch others, and be dropped for it
FAIL = 0.004  # part of the robots that fail before each field of a chain, where they stand


class Trial(NamedTuple):
    """What came of one trial."""

    right: bool
    said: str = ""  #: what went wrong, or what there is to tell
    lost: int = 0  #: targets lost, each by name
    cpu: float | None = None  #: [s] where the trial is not all that is measured


@cache
def array(name: str, data: Path | None = None) -> fp.FocalPlane:
    """An instrument by name, kept: planners keep what they know of it."""
    if name == "desi-petal":
        return desi.petal(fp.FocalPlane.load(data / DESI), 0)
    return fp.FocalPlane.load(name) if name.isalpha() else fp.FocalPlane.hexagonal(int(name), PITCH)


def margin_of(plane: fp.FocalPlane) -> float:
    usual = 0.0 if plane.name.startswith("desi-fp") else MARGIN
    return usual if plane.recommended_margin is None else plane.recommended_margin


def some_array(seed: int) -> fp.FocalPlane:
    return array("sdss" if seed % 5 == 4 else str(4 + seed % 3))


def judged(plan: fp.Plan) -> str:
    """Why a plan is not right; "" if it is proven, and says why of everyone who is lost."""
    faults = [*plan.faults()]
    silent = [loss.id for loss in fp.diagnose(plan).losses if not (loss.names or plan.problem.dropped)]
    faults += [f"{id_} is lost, and nobody is named" for id_ in silent]
    return "; ".join(faults)


def planned(problem: fp.Problem, seed: int) -> tuple[fp.Plan, float]:
    cpu, _, plan = warm(lambda: fp.planners.Direct(seed=seed).plan(problem))
    return plan, cpu


def onward(plane: fp.FocalPlane, state: fp.State, goal: np.ndarray, seed: int) -> Trial:
    """Plan from a state as it is found to a goal."""
    problem = fp.Problem(plane, state, goal, margin_of(plane), conflicts="drop", near_start="open")
    plan, cpu = planned(problem, seed)
    fault = judged(plan)
    return Trial(not fault, fault, len(plan.lost), cpu)


def field_to_field(seed: int) -> fp.Plan:
    plane = some_array(seed)
    start, goal = (uniform_field(plane, number, margin_of(plane)) for number in (3 * seed, 3 * seed + 1))
    return planned(fp.Problem(plane, start, goal, margin_of(plane)), seed)[0]


def disturbed(degrees: float) -> Callable[[int, Path], Trial]:
    """After a plan every joint is off by up to so many degrees; then the next field."""

    def trial(seed: int, data: Path) -> Trial:
        plan = field_to_field(seed)
        plane, rng = plan.problem.plane, np.random.default_rng(seed)
        off = np.radians(rng.uniform(-degrees, degrees, (plane.n, 2)))
        goal = uniform_field(plane, 3 * seed + 2, margin_of(plane))
        return onward(plane, fp.State(plan.end.angles + off), goal, seed)

    return trial


def stopped(seed: int, data: Path) -> Trial:
    """A motion stops at a random time; then the next field."""
    plan = field_to_field(seed)
    time = float(np.random.default_rng(seed).uniform(0.0, plan.makespan))
    plane = plan.problem.plane
    return onward(plane, plan.state_at(time), uniform_field(plane, 3 * seed + 2, margin_of(plane)), seed)


def in_contact(plane: fp.FocalPlane, seed: int, most: float = 3.0) -> np.ndarray:
    """A field in which one arm lies across one or two others, at random, all others clear of each other.

    Surfaces overlap by up to `most` [mm], the thickness of an arm: no arm passes through another.
    """
    rng = np.random.default_rng(seed)
    field = uniform_field(plane, seed, MARGIN)
    pairs = plane.arm_pairs_within(MARGIN)
    wanted = 1 + seed % 2
    while True:
        i = int(rng.integers(plane.n))
        angles = field.copy()
        angles[i] = plane.kinematics.random(plane, rng, np.array([i]))[0]
        gaps = signed_clearances(plane.arms, plane.with_obstacles(angles), pairs)
        if np.count_nonzero(gaps < MARGIN) == wanted == np.count_nonzero((gaps < 0) & (gaps > -most)):
            return angles


def touching(seed: int, data: Path) -> Trial:
    """One arm touches one or two others, in arrays of 19 to 61: `separate` parts them."""
    plane = array(str(2 + seed % 3))
    state = fp.State(in_contact(plane, seed))
    cpu, _, plan = warm(lambda: fp.separate(plane, state, MARGIN))
    certificate = fp.verify(plane, plan.trajectory, MARGIN, opening=True)
    wedged = plan.having(fp.Outcome.DEADLOCKED)
    end = fp.Problem(plane, plan.end, np.full((plane.n, 2), np.nan), MARGIN, near_start="open").opening
    never = [opening.pair for opening in certificate.opening if not np.isfinite(opening.time)]
    if certificate.ok and not len(wedged) and not end and not never:
        return Trial(True, cpu=cpu)
    named = ", ".join(plane.ids[i] for i in wedged)
    return Trial(False, f"{certificate}; wedged: {named or 'nobody'}; never apart: {never}", len(wedged), cpu)


def chain(name: str) -> Callable[[int, Path], Trial]:
    """Ten fields, each from where the one before ended; some targets touch, and now and then a robot fails."""

    def trial(seed: int, data: Path) -> Trial:
        plane, rng, lost, longest = array(name, data), np.random.default_rng(seed), 0, 0.0
        margin, state = margin_of(plane), fp.State.folded(plane)
        for number in range(FIELDS):
            failing = np.flatnonzero(state.online & (rng.random(plane.n) < FAIL))
            state = state.without(plane, failing, f"failed before field {number}")
            goal = uniform_field(plane, 100 * seed + number, margin).copy()
            who = np.flatnonzero(rng.random(plane.n) < UNCHECKED)
            goal[who] = plane.kinematics.random(plane, rng, who)
            try:
                done = fp.Problem(plane, state, goal, margin, conflicts="drop", near_start="open")
                plan, cpu = planned(done, seed)
            except FiberplanError as error:
                return Trial(False, f"broken at field {number}: {error}", lost, longest)
            if fault := judged(plan):
                return Trial(False, f"field {number}: {fault}", lost, longest)
            lost, longest, state = lost + len(plan.lost), max(longest, cpu), plan.end
        return Trial(True, lost=lost, cpu=longest)

    return trial


def design_on(where: str) -> Callable[[int, Path], Trial]:
    """A design that SDSS-V observed, on its own calibration, on the other site's and on the built-in array."""

    def trial(seed: int, data: Path) -> Trial:
        plane = {
            "right folder": lambda: sdss.array(data),
            "wrong site": lambda: fp.FocalPlane.load(data / OTHER_SITE),
            "built-in": lambda: array("sdss"),
        }[where]()
        try:
            cpu, _, solution = warm(lambda: sdss.design(data).solve(plane))
        except FiberplanError as error:
            return Trial(where != "right folder", f"refused: {error}")
        return Trial(where == "right folder", solution.notes[0], cpu=cpu)

    return trial


def pfs_folded(seed: int, data: Path) -> Trial:
    """2,394 nominal cobras from folded to a field: every target."""
    plane = array("pfs")
    problem = fp.Problem(plane, plane.folded, uniform_field(plane, seed, MARGIN), MARGIN)
    plan, cpu = planned(problem, seed)
    fault = judged(plan) or (f"{len(plan.lost)} lost" if len(plan.lost) else "")
    return Trial(not fault, fault, len(plan.lost), cpu)


def desi_field(seed: int, data: Path) -> Trial:
    """All ten petals from today's angles to a field of targets that touch nothing at rest.

    Right if it is proven and at most 0.1 % of the targets are lost without a proof, each with those in its way.
    """
    plane = array_of(data / DESI)
    state = fp.State.read(data / DESI, plane)
    goal = uniform_field(plane, seed, start=state.angles)
    done = fp.Problem(plane, state, goal, conflicts="drop", near_start="open")
    plan, cpu = planned(done, seed)
    unproven = [plane.ids[i] for i in plan.having(fp.Outcome.DEADLOCKED)]
    wanted, barred = int(done.plane.online.sum()), len(plan.having(fp.Outcome.INFEASIBLE))
    said = f"{len(plan.having(fp.Outcome.ARRIVED))} of {wanted} arrive, {len(done.dropped)} dropped, {barred} barred"
    said += f", unproven: {', '.join(unproven) or 'nobody'}; {plan.makespan:.2f} s"
    fault = judged(plan) or ("too many unproven" if len(unproven) > wanted // 1000 else "")
    return Trial(not fault, f"{fault}{'; ' * bool(fault)}{said}", len(plan.lost), cpu)


@cache
def array_of(path: Path) -> fp.FocalPlane:
    """An instrument from its file, kept."""
    return fp.FocalPlane.load(path)


def desi_load(seed: int, data: Path) -> Trial:
    """All ten petals from their file."""
    cpu, _, plane = warm(lambda: fp.FocalPlane.load(data / DESI))
    return Trial(plane.n == 5020, cpu=cpu)


__all__ = [
    "ARRAY",
    "DESI",
    "DESIGN",
    "Trial",
    "chain",
    "desi_field",
    "desi_load",
    "design_on",
    "disturbed",
    "pfs_folded",
    "stopped",
]
