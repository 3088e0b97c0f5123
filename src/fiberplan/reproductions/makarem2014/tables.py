"""What the experiments gave, as rows beside what the paper says."""

from collections.abc import Iterator

import numpy as np

from fiberplan.planners.shared.repulsion import theorem1_bound
from fiberplan.reproductions.makarem2014 import published
from fiberplan.reproductions.makarem2014.conflict import Conflict
from fiberplan.reproductions.makarem2014.few_bits import FewBits
from fiberplan.reproductions.makarem2014.rules import LITERAL, RULES
from fiberplan.reproductions.makarem2014.trials import Runs, Trial
from fiberplan.reproductions.rows import Row, mean, share, value


def run_times(runs: Runs) -> Iterator[Row]:
    """Fig. 5."""
    for (rule, _), trials in runs.trials.items():
        paper = published.RUN_TIME.get(trials[0].n)
        times = [trial.cpu for trial in trials]
        yield mean(f"Fig. 5: computing time, N = {trials[0].n}, {rule.name} [s]", paper, times)
    for rule in RULES:
        some = [trials for (other, _), trials in runs.trials.items() if other is rule and trials[0].n > 200]
        if len(some) > 1:
            size, time = [np.log([np.mean([getattr(t, f) for t in trials]) for trials in some]) for f in ("n", "cpu")]
            growth = np.polyfit(size, time, 1)[0]
            quantity = f"Fig. 5: computing time grows as N to the power of, {rule.name}"
            yield value(quantity, published.RUN_TIME_GROWTH, growth, sum(len(trials) for trials in some))


def motion_times(runs: Runs) -> Iterator[Row]:
    """Fig. 6."""
    for (rule, _), trials in runs.trials.items():
        times = [trial.motion_time for trial in trials]
        yield mean(f"Fig. 6: motion time, N = {trials[0].n}, {rule.name} [s]", published.MOTION_TIME, times)


def arrivals(runs: Runs, field: str) -> Iterator[Row]:
    """Who converges and who touches, over all runs."""
    for rule in dict.fromkeys(rule for rule, _ in runs.trials):
        trials = [trial for (other, _), some in runs.trials.items() if other is rule for trial in some]
        words = f"{field} fields, {rule.name}"
        sizes = [trial.n for trial in trials]
        yield _weighted(f"share of fibers that converge, {words}", published.CONVERGED, trials, "converged")
        yield _weighted(f"share of positioners that end exactly at their goals, {words}", None, trials, "arrived")
        all_ = [trial.converged == 1.0 for trial in trials]
        yield share(f"share of runs in which all converge, {words}", published.CONVERGED, all_)
        touched = [trial.contacts > 0 for trial in trials]
        yield share(f"runs with a contact, {words}", published.CONTACTS, touched)
        yield share(f"runs proven safe, {words}", None, [trial.proven for trial in trials])
        failed = sum(1 for failure in runs.failures if failure.rule == rule.name)
        yield value(f"runs that leave someone behind, {words}", None, failed, len(sizes))


def _weighted(quantity: str, paper: float | None, trials: list[Trial], what: str) -> Row:
    """A share of all positioners together; n counts these."""
    sizes = np.array([trial.n for trial in trials])
    ours = np.average([getattr(trial, what) for trial in trials], weights=sizes)
    return value(quantity, paper, ours, int(sizes.sum()))


def spacing(near: Runs, far: Runs, apart: float) -> Iterator[Row]:
    """What the spacing of goals does to the printed field."""
    for runs, least in ((near, published.SPACING), (far, apart)):
        for rule in (LITERAL,):
            trials = [t for (other, _), some in runs.trials.items() if other is rule for t in some]
            missing = [1.0 - trial.converged for trial in trials]
            words = f"starts and goals at least {least:g} mm apart, N = {trials[0].n}, {rule.name}"
            yield mean(f"share of fibers that do not converge, {words}", 0.0, missing)


def conflict(conflict: Conflict) -> Iterator[Row]:
    """Fig. 7 and 8."""
    away = np.hypot(*(conflict.fibers[-1] - conflict.targets).T)
    yield share("Fig. 7: share of the three that converge", 1.0, away <= 0.1)
    yield value("Fig. 7: way that one leaves its target to make room [mm]", None, conflict.detours.max(), 1)
    yield value(
        "Fig. 7: smallest distance of two fiber ends [mm]", f"> {published.SPACING:g}", conflict.closest.min(), 1
    )
    for k, (joint, most) in enumerate(zip(("theta", "phi"), published.SPEEDS, strict=True)):
        fastest = np.degrees(np.abs(conflict.speeds[:, :, k]).max())
        yield value(f"Fig. 8: largest speed of {joint} [deg/s]", f"<= {most:g}", fastest, 3)


def few_bits(results: list[FewBits]) -> Iterator[Row]:
    """Speeds in a few bits, which the paper wants."""
    for bits in dict.fromkeys(one.bits for one in results):
        some = [one for one in results if one.bits == bits]
        words = f"speeds in {bits} bits, N = {some[0].n}"
        yield share(f"motions proven safe, {words}", None, [one.proven for one in some])
        yield share(f"motions with all within the convergence distance, {words}", None, [one.on_target for one in some])
        yield mean(f"motion time in times of that without, {words}", None, [one.longer for one in some])
        yield mean(f"tracking error at most, {words} [mm]", None, [one.error for one in some])
        yield mean(f"bits sent to a positioner, {words}", None, [one.sent for one in some])


def theorem(ratio: float) -> Iterator[Row]:
    """Theorem 1."""
    quantity = "Theorem 1: no spurious minimum if lambda1 / lambda2 is below [1/mm^2]"
    yield value(quantity, published.THEOREM_1, theorem1_bound(4.0, 2.0), 1)
    yield value("Theorem 1: lambda1 / lambda2 of the simulations [1/mm^2]", published.WEIGHTS, ratio, 1)
