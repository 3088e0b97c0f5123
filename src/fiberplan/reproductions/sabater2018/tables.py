"""What the experiments gave, as rows beside what the paper says."""

from collections.abc import Iterator

import numpy as np

from fiberplan.reproductions.rows import Row, share, value
from fiberplan.reproductions.sabater2018 import published
from fiberplan.reproductions.sabater2018.case import Case
from fiberplan.reproductions.sabater2018.trials import Trial

Times = tuple[float | None, float, float]


def plans(what: str, trials: list[Trial], solved: float | None, times: Times | None) -> Iterator[Row]:
    """Success, configuration times, start-stops, proofs and computing of one set of plans."""
    done = np.array([trial.time for trial in trials if trial.solved])
    low, middle, high = times or (None, None, None)
    yield share(f"{what}: share solved in under 120 s", solved, [trial.solved for trial in trials])
    for name, paper, number in (
        ("least", low, np.min),
        ("median", middle, np.median),
        ("mean", middle, np.mean),
        ("greatest", high, np.max),
    ):
        yield value(f"{what}: configuration time, {name} [s]", paper, number(done) if len(done) else None, len(done))
    most = max(trial.stops for trial in trials)
    yield value(f"{what}: most start-stops of any arm", published.STOPS, most, len(trials))
    yield share(f"{what}: share proven safe by verify", None, [trial.proven for trial in trials])
    computing = np.median([trial.computing for trial in trials])
    yield value(f"{what}: computing, median [s]", None, computing, len(trials))
    for trial in trials:
        for loss in trial.losses:
            yield value(f"{what}: plan {trial.number} loses {loss}", None, 1.0, 1)


def case(found: Case) -> Iterator[Row]:
    """Tables 1 and 2 of one plan."""
    what = "detailed case"
    yield value(f"{what}: computing [s]", published.COMPUTING, found.computing, 1)
    yield value(f"{what}: pair checks at 100 ms under way", published.CHECKS, found.checks, 1)
    yield value(f"{what}: the same of arms that have arrived", None, found.rest_checks, 1)
    ideal = sum(arm.unobstructed for arm in found.arms)
    yield value(f"{what}: pair checks had nothing been in the way", None, ideal, 1)
    longest = max(arm.steps for arm in found.arms)
    yield value(f"{what}: steps of the longest arm", published.LONGEST, longest, 1)
    yield value(f"{what}: configuration time [s]", None, found.plan.makespan, 1)
    for name, number in (("fewest", min), ("most", max)):
        yield value(f"{what}: {name} paths in a roadmap", published.PATHS, number(arm.paths for arm in found.arms), 12)
    for rank, arm in enumerate(found.arms):
        head = f"{what}: {rank + 1}. {arm.name}"
        yield value(f"{head}: steps to go", None, arm.steps, 1)
        yield value(f"{head}: steps of waiting", None, arm.waits, 1)
        yield value(f"{head}: edges of its path", None, arm.edges, 1)
        yield value(f"{head}: start-stops", None, arm.stops, 1)
        yield value(f"{head}: pair checks", None, arm.checks, 1)


def variation(name: str, park: list[Trial], chained: list[Trial]) -> Iterator[Row]:
    """One changed length."""
    for what, trials, solved in (
        ("from park", park, published.SOLVED_FROM_PARK),
        ("chained", chained, published.SOLVED_CHAINED),
    ):
        yield share(f"{name}: {what}: share solved", solved, [trial.solved for trial in trials])
        done = [trial.time for trial in trials if trial.solved]
        median = np.median(done) if done else None
        yield value(f"{name}: {what}: configuration time, median [s]", None, median, len(done))
    yield share(f"{name}: share proven safe by verify", None, [trial.proven for trial in park + chained])
