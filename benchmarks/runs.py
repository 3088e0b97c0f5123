"""One planner on one problem, and what a table says of many such runs.

CPU time is that of `plan` alone, with the kernels warm: a run during which anything was compiled is done again. What
the plan is worth is judged by `fiberplan.verify`, which knows nothing of planners; what it could not prove, and a
positioner said to arrive that does not, is a fault.
"""

import inspect
import statistics
import traceback
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numba.core.event import install_recorder

import fiberplan as fp
from fiberplan.errors import FiberplanError
from fiberplan.plan.bounds import proven_bounds
from fiberplan.planners import Planner
from measure import T, peak_memory, timed


@dataclass(frozen=True)
class Run:
    """One plan, in numbers that JSON can hold; without one (`refused`, `crashed`) the rest is empty."""

    seed: int
    refused: str | None = None  #: the planner's own words, if it is not meant for this
    crashed: str | None = None  #: any other exception, with where it was raised
    positioners: int = 0
    targets: int = 0  #: asked for, dropped ones included
    arrived: int = 0
    infeasible: int = 0  #: lost, proven that they had to be
    deadlocked: int = 0  #: lost without proof
    dropped: int = 0  #: of no plan's doing: their goals touch something at rest, or are out of reach
    makespan: float = 0.0  #: [s]
    bound: float = 0.0  #: kinematic, of those that arrive [s]
    need: float = 0.0  #: or what a pair, or one past what never moves, was found to need if that is more [s]
    proven: float | None = None  #: the part of that which is proven, if that was asked for [s]
    hub: bool = False  #: whether everybody went through the fold hub
    cpu: float = 0.0  #: of planning [s]
    wall: float = 0.0  #: [s]
    proof: float = 0.0  #: CPU of proving [s]
    knots: float = 0.0  #: per positioner
    reversals: float = 0.0  #: per joint: how often it turns back
    clearance: float | None = None  #: smallest proven of pairs that can move [mm]; None where nothing is near
    reaction: float | None = None  #: how soon somebody is touched by one that stops dead [s]; None: never, or not safe
    faults: tuple[str, ...] = ()  #: why the plan is not certified
    lost: dict[str, str] = field(default_factory=dict)  #: positioner -> outcome and those in its way
    notes: tuple[str, ...] = ()

    @property
    def planned(self) -> bool:
        """Whether there is a plan."""
        return self.refused is None and self.crashed is None

    @property
    def certified(self) -> bool:
        """Whether there is a plan that is proven safe and keeps its word."""
        return self.planned and not self.faults

    @property
    def ratio(self) -> float | None:
        """Makespan over bound; None where nobody has to move."""
        return self.makespan / self.bound if self.planned and self.bound > 0 else None

    @property
    def over_proven(self) -> float | None:
        """Makespan over what is proven to be needed; None where that was not asked for, or nobody has to move."""
        return self.makespan / self.proven if self.proven else None

    @property
    def over_need(self) -> float | None:
        """Makespan over what somebody was found to need; None where nobody has to move."""
        return self.makespan / self.need if self.planned and self.need > 0 else None


def run(
    seed: int, problem: fp.Problem, planner: Planner, deadline: float | None = None, prove: float | None = None
) -> Run:
    """Plan one problem, by a `deadline` [s] if the planner takes one, and judge the plan.

    What pairs are said to need is proven in steps of `prove` [rad], if that is given.
    """
    takes_one = deadline is not None and "deadline" in inspect.signature(planner.plan).parameters
    given = {"deadline": deadline} if takes_one else {}
    try:
        cpu, wall, plan = warm(lambda: planner.plan(problem, **given))
        proof, _, faults = timed(plan.faults)
    except FiberplanError as error:
        return Run(seed, refused=str(error))
    except Exception as error:
        return Run(seed, crashed=_where(error))
    counts = {name: len(plan.having(fp.Outcome[name.upper()])) for name in ("arrived", "infeasible", "deadlocked")}
    return Run(
        seed,
        positioners=plan.problem.n,
        targets=counts["arrived"] + len(plan.lost),
        dropped=len(plan.having(fp.Outcome.DROPPED)),
        makespan=plan.makespan,
        bound=plan.lower_bound,
        need=max(plan.lower_bound, *(b.seconds for b in plan.bounds), 0.0),
        proven=None if prove is None else max(plan.lower_bound, *(b.seconds for b in proven_bounds(plan, prove)), 0.0),
        hub=any("fold hub" in note for note in plan.notes),
        cpu=cpu,
        wall=wall,
        proof=proof,
        knots=len(plan.trajectory.times) / plan.problem.n,
        reversals=reversals(plan.trajectory),
        clearance=smallest_clearance(plan),
        reaction=reaction(plan),
        faults=tuple(faults),
        lost=_losses(plan),
        notes=plan.notes,
        **counts,
    )


def _where(error: Exception) -> str:
    """What went wrong, in one line, and the last line of this project's that it went wrong in."""
    frames = traceback.extract_tb(error.__traceback__)
    last = next((f for f in reversed(frames) if "fiberplan" in f.filename), frames[-1])
    text = next((line for line in str(error).splitlines() if line.strip()), "")
    return f"{type(error).__name__}: {text} ({Path(last.filename).name}, line {last.lineno})"


def warm(work: Callable[[], T]) -> tuple[float, float, T]:
    """`timed`, once more if a kernel had to be compiled."""
    with install_recorder("numba:compile") as compiled:
        result = timed(work)
    return timed(work) if compiled.buffer else result


def reversals(motion: fp.Trajectory) -> float:
    """How often a joint turns back, mean over all joints; rests do not count."""
    count = 0
    for knots in np.split(motion.angles, motion.offsets[1:-1]):
        for turn in np.diff(knots, axis=0).T:
            way = np.sign(turn[np.abs(turn) > 1e-9])
            count += int(np.count_nonzero(np.diff(way)))
    return count / (2 * motion.n)


def smallest_clearance(plan: fp.Plan) -> float | None:
    """Smallest proven clearance of two of which one can move [mm]; None where no two are near."""
    proof, online = plan.certificate, plan.problem.plane.online
    pairs = proof.clearance[online[proof.pairs].any(axis=1)]
    fixed = proof.obstacle_clearance[online[proof.obstacle_pairs[:, 0]]]
    both = np.concatenate([pairs, fixed])
    return float(both.min()) if len(both) else None


def reaction(plan: fp.Plan) -> float | None:
    """Proven time from one that stops dead to the first contact [s]; None: none, or the plan is unsafe."""
    if not plan.certificate.ok:
        return None
    seconds = plan.certificate.tolerates.reaction.seconds
    return seconds if np.isfinite(seconds) else None


def _losses(plan: fp.Plan) -> dict[str, str]:
    """Positioner that does not arrive -> what became of it, and who is in its way."""
    plane = plan.problem.plane

    def name(arm: int) -> str:
        return plane.ids[arm] if arm >= 0 else plane.obstacles[-1 - arm].name

    def told(i: int) -> str:
        blockers = ", ".join(name(arm) for arm in plan.blockers.get(i, ()))
        return plan.outcomes[i].name + (f", blocked by {blockers}" if blockers else "")

    return {plane.ids[i]: told(i) for i in plan.lost.tolist()}


def summary(runs: list[Run]) -> dict[str, float | int | str | None]:
    """A row of the table: what became of all targets, and medians and worst over the fields."""
    plans = [r for r in runs if r.planned]
    ratios = [r.ratio for r in plans if r.ratio is not None]
    needs = [r.over_need for r in plans if r.over_need is not None]
    proven = [r.over_proven for r in plans if r.over_proven is not None]
    clearances = [r.clearance for r in plans if r.clearance is not None]
    reactions = [r.reaction for r in plans if r.reaction is not None]
    cpu = [r.cpu for r in plans]

    def total(name: str) -> int:
        return sum(getattr(r, name) for r in plans)

    return {
        "fields": len(runs),
        "targets": total("targets"),
        "arrived": total("arrived"),
        "proven lost": total("infeasible"),
        "undecided": total("deadlocked"),
        "dropped": total("dropped"),
        "over bound": statistics.median(ratios) if ratios else None,
        "worst": max(ratios, default=None),
        "over need": statistics.median(needs) if needs else None,
        "worst need": max(needs, default=None),
        "over proven": statistics.median(proven) if proven else None,
        "worst proven": max(proven, default=None),
        "hub": total("hub"),
        "CPU [s]": statistics.median(cpu) if cpu else None,
        "worst CPU": max(cpu, default=None),
        "knots": statistics.median(r.knots for r in plans) if plans else None,
        "reversals": statistics.median(r.reversals for r in plans) if plans else None,
        "clearance": min(clearances, default=None),
        "reaction [s]": min(reactions, default=None),
        "memory [MiB]": peak_memory(),
        "certified": _verdict(runs),
    }


def _verdict(runs: list[Run]) -> str:
    """Yes only if every field has a plan that is proven safe and keeps its word."""
    crashed, refused = sum(r.crashed is not None for r in runs), sum(r.refused is not None for r in runs)
    unproven = sum(r.planned and not r.certified for r in runs)
    parts = [(unproven, "not"), (crashed, "crashed"), (refused, "refused")]
    return ", ".join(f"{count} {what}" for count, what in parts if count) or "yes"
