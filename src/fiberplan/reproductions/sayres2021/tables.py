"""What the experiments gave, as rows beside what the paper says."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.coverage import coverage
from fiberplan.motion import Trajectory
from fiberplan.reproductions.rows import Row, mean, share, value
from fiberplan.reproductions.sayres2021 import published
from fiberplan.reproductions.sayres2021.relief import Reliefs, Relieved
from fiberplan.reproductions.sayres2021.rules import CERTIFIED, RULES, Rule
from fiberplan.reproductions.sayres2021.trials import Sweep, apart, turned

COVERAGE_STEP = 0.5  #: between points of a map [mm]
REGIMES = {"below": f"below {published.COLLAPSE:g} mm", "above": f"above {published.COLLAPSE:g} mm"}


def degrees(step: float) -> str:
    """A step [rad] as text."""
    return f"{np.degrees(step):g} deg"


def workspaces(plane: FocalPlane) -> Iterator[Row]:
    """Figs. 4 and 7: who reaches where, and who can touch whom."""
    shares = coverage(plane, COVERAGE_STEP).shares()
    for k, part in enumerate(shares, 1):
        yield value(f"Fig. 4: share of the area that is reached by {k}", None, part, 1)
    yield value("Fig. 4: share of the area that is reached by 3 or more", published.REACHED, shares[2:].sum(), 1)
    pairs = plane.pairs_within(0.0).ravel()
    others = np.bincount(pairs, minlength=plane.n)
    yield value("Fig. 7: most others that a positioner can touch", published.TOUCHED, others.max(), plane.n)
    yield value("Fig. 7: others that a positioner can touch, median", None, np.median(others), plane.n)


def paths(plane: FocalPlane, motions: list[Trajectory], steps: list[float]) -> Iterator[Row]:
    """Fig. 10: the same field folded at two steps; the positioner drawn is the most winding one."""
    i = most_winding(motions)
    for motion, step in zip(motions, steps, strict=True):
        yield value(f"Fig. 10: fold time at {degrees(step)} [s]", None, motion.duration, 1)
        turn = np.degrees(turned(motion)[i])
        yield value(f"Fig. 10: turn of the positioner drawn, {plane.ids[i]}, at {degrees(step)} [deg]", None, turn, 1)
    gap = apart(plane, *motions)
    between = f"between {' and '.join(degrees(step) for step in steps)}"
    yield value(f"Fig. 10: way of its fiber {between}, farthest apart [mm]", None, gap[i], 1)
    yield value(f"Fig. 10: way of any fiber {between}, farthest apart, median [mm]", None, np.median(gap), plane.n)
    yield value(f"Fig. 10: share of fibers never 1 mm apart {between}", None, np.mean(gap < 1.0), plane.n)


def most_winding(motions: list[Trajectory]) -> int:
    """The positioner whose joints turn most beyond what they must, in all of `motions`."""
    needless = [turned(motion) - np.abs(motion.end - motion.start).sum(axis=1) for motion in motions]
    return int(np.argmax(np.min(needless, axis=0)))


def run_times(times: dict[tuple[Rule, float], list[float]]) -> Iterator[Row]:
    """Fig. 11."""
    for (rule, step), values in times.items():
        yield mean(f"Fig. 11: run time at {degrees(step)}, {rule.name} [s]", published.run_time(step), values)


def folded(sweep: Sweep) -> Iterator[Row]:
    """Fig. 12."""
    for (rule, buffer), trials in sweep.items():
        shares = [trial.folded for trial in trials]
        yield mean(f"Fig. 12: share folded, {_at(buffer, rule)}", published.folded(buffer), shares)


def deadlocks(sweep: Sweep, step: float) -> Iterator[Row]:
    """Fig. 14."""
    for (rule, buffer), trials in sweep.items():
        stuck = [not trial.complete for trial in trials]
        quantity = f"Fig. 14: deadlock chance at {degrees(step)}, {_at(buffer, rule)}"
        yield share(quantity, published.deadlock(buffer), stuck)


def replacements(reliefs: Reliefs) -> Iterator[Row]:
    """Fig. 15."""
    for rule in RULES:
        for side, where in REGIMES.items():
            pooled = pool(reliefs, rule, side)
            counts = [len(t.replaced) for t in pooled if t.replaced]
            median = np.median(counts) if counts else None
            words = f"buffers {where}, {rule.name}"
            yield value(
                f"Fig. 15: replacements in a deadlocked trial, median, {words}",
                published.REPLACEMENTS[side],
                median,
                len(counts),
            )
            needed = published.NEEDED if side == "below" else None
            yield share(f"Fig. 15: share of trials that need any, {words}", needed, [bool(t.replaced) for t in pooled])
            yield mean(f"Fig. 15: share of targets lost, {words}", published.LOST[side], [t.lost for t in pooled])
            yield share(f"Fig. 15: share of trials resolved, {words}", 1.0, [t.trial.complete for t in pooled])


def pool(reliefs: Reliefs, rule: Rule, side: str) -> list[Relieved]:
    """Trials under `rule` at all buffers of a regime."""
    return [
        trial
        for (other, buffer), trials in reliefs.items()
        if other is rule and published.regime(buffer) == side
        for trial in trials
    ]


def fold_times(sweep: Sweep, reliefs: Reliefs) -> Iterator[Row]:
    """Fig. 16: of fields that fold by themselves, where any do, and of those made to fold."""
    paper = _plus_minus(published.FOLD_TIME)
    for (rule, buffer), trials in sweep.items():
        times = [trial.fold_time for trial in trials if trial.complete]
        if times:
            yield mean(f"Fig. 16: fold time, {_at(buffer, rule)} [s]", paper, times)
    for (rule, buffer), relieved in reliefs.items():
        times = [one.trial.fold_time for one in relieved if one.trial.complete]
        after = f"after replacements, {_at(buffer, rule)} [s]"
        yield mean(f"Fig. 16: fold time {after}", paper, times)
        yield mean(f"Fig. 16: target to target {after}", _plus_minus(published.MOVE_TIME), target_to_target(times))


def target_to_target(times: list[float]) -> list[float]:
    """Time of moving from each field through folded to the next [s], from their fold times."""
    return [a + b for a, b in pairwise(times)]


def forward(arrived: dict[Rule, list[float]]) -> Iterator[Row]:
    """The same greedy from folded towards targets."""
    for rule, shares in arrived.items():
        yield mean(f"forward greedy: share that arrives, {rule.name}", "utterly fails", shares)


def contacts(sweep: Sweep, step: float) -> Iterator[Row]:
    """What `verify` says of the simultaneous motions, all buffers together."""
    for rule in RULES:
        trials = [trial for (other, _), some in sweep.items() if other is rule for trial in some]
        words = f"at {degrees(step)}, {rule.name}"
        yield share(f"motions with a contact {words}", None, [trial.overlap > 0.0 for trial in trials])
        yield value(f"deepest contact {words} [mm]", None, max(trial.overlap for trial in trials), len(trials))
        if rule is CERTIFIED:
            yield share(f"motions proven safe {words}", None, [trial.proven for trial in trials])


def _at(buffer: float, rule: Rule) -> str:
    return f"buffer {buffer:.2f} mm, {rule.name}"


def _plus_minus(pair: tuple[float, float]) -> str:
    return f"{pair[0]:g} +- {pair[1]:g}"
