"""Allocation: the conflict table, solvers side by side, tiers, the motion in the loop, and what the tie-break saves.

Catalogues are uniform over the array, with priorities 1, 2, 5 and 10, equally many of each. CPU is of one core, kernels
warm; the calibration that is printed first lets machines compare.

Usage: python benchmarks/survey.py [--only PART] [--fields N] [--targets M] [--buffer MM] [--quick]
"""

import argparse
import dataclasses
import statistics
from collections.abc import Callable, Iterator
from functools import cache

import numpy as np
from scipy.optimize import linprog
from scipy.spatial import cKDTree

import fiberplan as fp
from fiberplan.scenes import uniform_field
from fiberplan.survey import Catalogue, allocate, conflicts
from fiberplan.survey.choices import Choices
from fiberplan.survey.cliques import cliques
from fiberplan.survey.levels import travel_times
from fiberplan.survey.local_search import greedy_order, local_search
from measure import calibrated, peak_memory, timed
from scenes.scene import margin_of
from scenes.uniform import desi_like, sayres

SIZES = ((547, 3_000), (547, 1_000), (4_921, 50_000))
TABLES = (*SIZES, (19_441, 200_000))
PRIORITIES = (1.0, 2.0, 5.0, 10.0)
BUFFERS = (1.5, 2.0, 2.5)  # [mm]


def plane_of(n: int) -> tuple[fp.FocalPlane, float]:
    """The array of so many, and its margin [mm]: a buffer of 2.0 mm for those of Sayres2021."""
    return (sayres(), margin_of(2.0)) if n == 547 else (desi_like(n), 0.0)


def catalogue(plane: fp.FocalPlane, count: int, seed: int) -> Catalogue:
    """Targets uniform over all that some fiber can be as near to as its reach."""
    rng = np.random.default_rng(seed)
    reach = float((plane.length + np.hypot(*plane.fiber.T)).max())
    far = np.hypot(*plane.base.T).max() + reach
    points = rng.uniform(-far, far, (4 * count, 2))
    points = points[cKDTree(plane.base).query(points)[0] < reach][:count]
    return Catalogue(*points.T, priority=rng.choice(PRIORITIES, count))


def peer_rule(choices: Choices) -> np.ndarray:
    """Targets by falling priority, each to the free positioner with fewest targets, and then one exchange for each.

    As fiberassign does, with contacts at rest: a target for which nobody is free gets a positioner whose own target
    can go to another one.
    """
    held = np.full(len(choices.place_first) - 1, -1)
    n = int(choices.robot.max()) + 1
    few = np.bincount(choices.robot)[choices.robot]

    def rivals(v: int) -> list[int]:
        touched = [u for u in choices.touched(v).tolist() if held[choices.place[u, 0]] == u]
        return list(dict.fromkeys([u for u in held[choices.place[v]].tolist() if u >= 0] + touched))

    def put(v: int) -> None:
        held[choices.place[v]] = v

    waiting = []
    order = np.lexsort((few, choices.place[:, 1], -choices.weight[:, 0]))
    first = np.flatnonzero(np.diff(choices.place[order, 1], prepend=-1))
    for options in np.split(order, first[1:]):
        free = [v for v in options.tolist() if not rivals(v)]
        put(free[0]) if free else waiting.append(options.tolist())
    for options in waiting:
        for v in options:
            if len(mine := rivals(v)) != 1:
                continue
            held[choices.place[mine[0]]] = -1
            put(v)
            others = [u for u in choices.at(choices.place[mine[0], 1]).tolist() if not rivals(u)]
            if others:
                put(others[0])
                break
            held[choices.place[v]] = -1
            put(mine[0])
    return np.unique(held[:n][held[:n] >= 0])


def greedy(choices: Choices) -> np.ndarray:
    """Options by falling priority, each that excludes none before it."""
    return local_search(choices, 0, 0, begin=greedy_order(choices))


def cp_sat(choices: Choices, begin: np.ndarray) -> tuple[float, float] | None:
    """Value and bound of OR-tools' CP-SAT on the same cliques from the same set; None where it is not installed."""
    try:
        from ortools.sat.python import cp_model
    except ImportError:
        return None
    model, matrix = cp_model.CpModel(), cliques(choices)
    x = [model.new_bool_var("") for _ in range(len(choices.place))]
    for row in range(matrix.shape[0]):
        model.add_at_most_one(x[v] for v in matrix.indices[matrix.indptr[row] : matrix.indptr[row + 1]].tolist())
    model.maximize(cp_model.LinearExpr.weighted_sum(x, choices.weight[:, 0].tolist()))
    taken = np.isin(np.arange(len(x)), begin)
    for variable, value in zip(x, taken.tolist(), strict=True):
        model.add_hint(variable, value)
    solver = cp_model.CpSolver()
    solver.parameters.num_workers, solver.parameters.random_seed = 1, 0
    solver.parameters.linearization_level, solver.parameters.max_deterministic_time = 2, 60.0
    solver.solve(model)
    return solver.objective_value, solver.best_objective_bound


def table_rows(seed: int, quick: bool) -> Iterator[str]:
    """The conflict table."""
    for n, count in TABLES[: 2 if quick else None]:
        plane, margin = plane_of(n)
        listed = catalogue(plane, count, seed)
        before = peak_memory()
        cpu, _, table = timed(lambda plane=plane, listed=listed, margin=margin: conflicts(plane, listed, margin))
        yield (
            f"conflicts {n:>6} x {count:<7} CPU {cpu:6.2f} s   {len(table.options):>7} options, {table.nnz // 2:>7} "
            f"touch, peak + {peak_memory() - before:.0f} MiB"
        )


def solver_rows(seed: int, quick: bool) -> Iterator[str]:
    """Solvers side by side: priority kept, what of the bound is missing, CPU."""
    for n, count in SIZES[: 2 if quick else None]:
        plane, margin = plane_of(n)
        listed = catalogue(plane, count, seed)
        best = allocate(plane, listed, margin, motion=False)
        bound = best.bound

        def row(name: str, value: float, cpu: float, bound: float, size: str = f"{n:>6} x {count:<6}") -> str:
            gap = 1 - value / bound
            return f"{name:<20} {size} {value:>8.0f} of {bound:>8.0f}, gap {gap:6.2%}, CPU {cpu:6.2f} s"

        choices: Choices = best.choices
        for name, rule in (("greedy by priority", greedy), ("peer rule", peer_rule)):
            cpu, _, chosen = timed(lambda rule=rule, choices=choices: rule(choices))
            yield row(name, choices.weight[chosen, 0].sum(), cpu, bound)
        for name in ("heuristic", "milp"):
            cpu, _, found = timed(
                lambda name=name, plane=plane, listed=listed, margin=margin: allocate(
                    plane, listed, margin, motion=False, solver=name
                )
            )
            yield row(f"{name}, all of it", found.value, cpu, found.bound)
        cpu, _, found = timed(lambda choices=choices: cp_sat(choices, greedy(choices)))
        yield "CP-SAT: not installed" if found is None else row("CP-SAT, from greedy", found[0], cpu, found[1])


def tier_rows(seed: int) -> Iterator[str]:
    """Three tiers of the largest array, equally many in each, and few in the first."""
    n, count = SIZES[-1]
    plane, margin = plane_of(n)
    listed = catalogue(plane, count, seed)
    for shares in ((1 / 3, 1 / 3, 1 / 3), (0.03, 0.12, 0.85)):
        tier = np.random.default_rng(seed + 1).choice([1, 2, 3], count, p=shares)
        tiered = dataclasses.replace(listed, tier=tier)
        for solver in ("heuristic", "milp"):
            cpu, _, found = timed(
                lambda tiered=tiered, solver=solver: allocate(plane, tiered, margin, motion=False, solver=solver)
            )
            worth = ", ".join(f"{each.value:.0f} of {each.bound:.0f}" for each in found.tiers)
            yield f"tiers {n} x {count}, shares {shares[0]:.0%} first, {solver:<10} {worth}, CPU {cpu:.1f} s"


def motion_rows(seed: int, fields: int, counts: list[int], buffers: list[float]) -> Iterator[str]:
    """Allocate, plan, choose again until all arrive."""
    plane = sayres()
    for count in counts:
        for buffer in buffers:
            margin, cpu, found = margin_of(buffer), [], []
            for k in range(seed, seed + fields):
                start = uniform_field(plane, k, margin)
                listed = catalogue(plane, count, k)
                seconds, _, one = timed(
                    lambda listed=listed, start=start, margin=margin: allocate(plane, listed, margin, start=start)
                )
                cpu.append(seconds)
                found.append(one)
            proven = sum(one.plan.certificate.ok and not len(one.plan.lost) for one in found)
            rounds = np.bincount([one.rounds for one in found])[1:]
            paid = sum(one.price for one in found) / sum(one.value + one.price for one in found)
            times = [one.plan.makespan for one in found]
            yield (
                f"motion {count} targets, buffer {buffer:.1f}: {proven} of {fields} arrive proven, paid {paid:.3%}, "
                f"gap worst {max(one.gap for one in found):.2%}, planned 1, 2, ... times {rounds.tolist()}, makespan "
                f"median {statistics.median(times):.2f} s, CPU median {statistics.median(cpu):.1f}, "
                f"worst {max(cpu):.1f} s"
            )


def tie_rows(seed: int, fields: int, counts: list[int]) -> Iterator[str]:
    """The slowest option with and without the tie-break, and the least that any set of the same value can have."""
    plane, margin = sayres(), margin_of(2.0)
    for count in counts:
        saved, kinds = [], []
        for k in range(seed, seed + fields):
            start = uniform_field(plane, k, margin)
            found = allocate(plane, catalogue(plane, count, k), margin, start=start, motion=False)
            times = travel_times(found.problem, found.table.options)
            plain = allocate(plane, found.catalogue, margin, motion=False)  # from folded: blind to this start
            longest = [float(times[each.chosen].max()) for each in (plain, found)]
            kinds.append([*longest, least_time(found.choices, times, found.value)])
            saved.append(1 - longest[1] / longest[0])
        blind, short, least = np.median(np.array(kinds), axis=0)
        yield (
            f"ties {count} targets: slowest {blind:.2f} s without, {short:.2f} s with, at least {least:.2f} s at "
            f"this value; saved {statistics.median(saved):.1%}, {min(saved):.1%} to {max(saved):.1%} in {fields} fields"
        )


def least_time(choices: Choices, times: np.ndarray, value: float) -> float:
    """No set of this value has a slowest option quicker than this [s], by the linear relaxation."""
    matrix, worth = cliques(choices), choices.weight[:, 0].astype(float)
    low, high = 0.0, float(times.max())
    while high - low > 0.05:
        middle = 0.5 * (low + high)
        ends = np.stack([np.zeros(len(times)), (times <= middle).astype(float)], axis=1)
        relaxed = linprog(-worth, A_ub=matrix, b_ub=np.ones(matrix.shape[0]), bounds=ends, method="highs")
        low, high = (low, middle) if -relaxed.fun >= value - 1e-6 else (middle, high)
    return low


@cache
def warm() -> None:
    """Compile."""
    allocate(sayres(), catalogue(sayres(), 50, 0), 1.0)


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--only", choices=("conflicts", "solvers", "tiers", "motion", "ties"))
    parser.add_argument("--fields", type=int, default=20, help="of motion and ties, each")
    parser.add_argument("--targets", type=int, nargs="+", default=[1_000, 3_000], help="of motion and ties, in a field")
    parser.add_argument("--buffer", type=float, nargs="+", default=list(BUFFERS), help="of motion [mm]")
    parser.add_argument("--seed", type=int, default=0, help="of the first field")
    parser.add_argument("--quick", action="store_true", help="547 positioners only")
    options = parser.parse_args()
    print(f"calibration: 10^8 segment distances in {calibrated(1):.2f} s CPU", flush=True)
    warm()
    parts: dict[str, Callable[[], Iterator[str]]] = {
        "conflicts": lambda: table_rows(options.seed, options.quick),
        "solvers": lambda: solver_rows(options.seed, options.quick),
        "tiers": lambda: tier_rows(options.seed),
        "motion": lambda: motion_rows(options.seed, options.fields, options.targets, options.buffer),
        "ties": lambda: tie_rows(options.seed, options.fields, options.targets),
    }
    for name, rows in parts.items():
        if options.only in (None, name):
            for line in rows():
                print(line, flush=True)


if __name__ == "__main__":
    main()
