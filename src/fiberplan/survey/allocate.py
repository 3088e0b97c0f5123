"""From a catalogue to an allocation: options, what they are worth, the best set, and the motion that reaches it."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from fiberplan.arrays import number, read_only
from fiberplan.arrays.seeds import seed_complaint
from fiberplan.errors import ProblemError
from fiberplan.focal_plane import FocalPlane
from fiberplan.planners import Direct
from fiberplan.planners.protocol import Planner
from fiberplan.problem import State
from fiberplan.survey.allocation import Allocation, Quota, Tier
from fiberplan.survey.catalogue import Catalogue
from fiberplan.survey.choices import Choices
from fiberplan.survey.conflicts import touching_options
from fiberplan.survey.levels import Levels
from fiberplan.survey.motion import Arrived, arriving, targets_of
from fiberplan.survey.options import options_of
from fiberplan.survey.quotas import Quotas
from fiberplan.survey.solve import Solver, solve
from fiberplan.survey.standing import standing


def allocate(
    plane: FocalPlane,
    catalogue: Any,
    margin: float = 0.0,
    *,
    start: State | np.ndarray | None = None,
    motion: bool = True,
    required: Mapping[str, int] | None = None,
    regions: Any = 1,
    stay: Any = None,
    position_error: Any = None,
    solver: Solver = "milp",
    planner: Planner | None = None,
    seed: int = 0,
    deadline: float | None = None,
) -> Allocation:
    """Which positioner takes which target: the most total priority, tier before tier, that can be reached together.

    Required positions come first, as far as they can be had, then tier after tier; no target of one is given up for any
    of a later one. Of what is equally good, the shorter motion from `start` is taken. Nothing touches at rest.

    Args:
        plane: the array; positioners that are offline keep their place.
        catalogue: a `Catalogue`, or what `Catalogue.of` takes: a table of astropy, a `Targets`, the path of a file.
        margin: clearance to keep, at rest and in motion [mm].
        start: where everyone stands now: a state, or (n, 2) commanded angles [rad]; folded unless given.
        motion: plan the motion, and where a target is lost in it choose again around it, until all that is allocated
            arrives, proven; False: at rest only.
        required: category -> how many of its positions are needed, such as {"sky": 80, "standard": 20}. Positions of
            these categories count for nothing else, and no more of them are taken.
        regions: over how many parts of the array, of equally many positioners, required positions are spread; or (n,)
            the part of each positioner, from 0.
        stay: ids or indices of positioners that keep their place, or (n,) flags; nobody unless given.
        position_error: (n,) or shared: more room for some, each arm's own, on top of the margin [mm].
        solver: "milp", or "heuristic" for local search alone, whose gap is stated.
        planner: of the motion; `Direct` with the same seed unless given.
        seed: of every random choice.
        deadline: wall-clock seconds for each integer program. Where one is cut short the allocation is marked
            `interrupted`; without a deadline, budgets count work.

    Raises:
        TargetError: a catalogue that cannot be used.
        ProblemError: a setting that makes no sense, or a positioner that does not exist.
    """
    listed = Catalogue.of(catalogue)
    if solver not in ("milp", "heuristic"):
        raise ProblemError(f"solver must be 'milp' or 'heuristic', got '{solver}'")
    if complaint := seed_complaint(seed):
        raise ProblemError(complaint)
    if deadline is not None and not number(deadline, "s", "deadline", ProblemError) > 0:
        raise ProblemError(f"deadline must be a time of more than 0 s, got {deadline:g}")
    there = standing(plane, start, stay, margin, position_error)
    quotas = Quotas.of(there.plane, required, regions)
    table = touching_options(there, options_of(there.plane, listed, there.plane.online))
    options = table.options
    group = quotas.group(listed, options.positioner, options.target)
    levels = Levels.of(there, listed, options, group)
    choices = Choices.of(table, plane.n, len(listed), levels.weight, group, quotas.need)
    solved = solve(choices, solver, seed, deadline)
    arrived = Arrived(solved.chosen, choices, None, 0)
    if motion:
        arrived = arriving(there, listed, table, choices, solved.chosen, planner or Direct(seed=seed), seed)
    chosen = arrived.chosen
    value = _values(listed, options.target[solved.chosen], group[solved.chosen], levels)
    bounds = solved.bounds[levels.first_tier : -1]
    kept = _values(listed, options.target[chosen], group[chosen], levels)
    return Allocation(
        catalogue=listed,
        problem=there,
        table=table,
        choices=arrived.choices,
        chosen=read_only(chosen, np.int64),
        tiers=tuple(
            Tier(tier, *kept[k], max(kept[k][1], _bound(bounds[k], levels.scale[k], plane.n)))
            for k, tier in enumerate(levels.tiers)
        ),
        quotas=_met(quotas, group[chosen]),
        plan=arrived.plan,
        rounds=arrived.rounds,
        price=sum(each[1] for each in value) - sum(each[1] for each in kept),
        solver=solver,
        seed=seed,
        interrupted=solved.interrupted or (arrived.plan is not None and arrived.plan.interrupted),
        required=quotas,
        targets=targets_of(there, listed, table, chosen),
    )


def _values(catalogue: Catalogue, rows: np.ndarray, group: np.ndarray, levels: Levels) -> list[tuple[int, float]]:
    """Of each tier, how many of the targets `rows` (k,) are in it, and their total priority."""
    rows = rows[group < 0]
    mine = [rows[catalogue.tier[rows] == tier] for tier in levels.tiers]
    return [(len(each), float(catalogue.priority[each].sum())) for each in mine]


def _bound(whole: int, scale: float, n: int) -> float:
    """A bound in whole numbers as a priority, with what rounding may have taken from n of them."""
    exact = np.log10(scale) % 1 == 0
    return float(whole / scale if exact else (whole + 0.5 * n) / scale)


def _met(quotas: Quotas, group: np.ndarray) -> tuple[Quota, ...]:
    """What is required of each category in each region, and what there is."""
    there = np.bincount(group[group >= 0], minlength=len(quotas.need))
    return tuple(
        Quota(*quotas.named(k), int(need), int(there[k])) for k, need in enumerate(quotas.need.tolist()) if need
    )
