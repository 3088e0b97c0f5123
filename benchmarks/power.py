"""Few robots of a power supply at once: what waiting does to supplies, how long it makes the motion, what it costs.

``python benchmarks/power.py desi --fields 3`` plans seeded fields of a petal for the controller, and exports each
without and with ``power``, with the buses of its focal-plane file; ``sdss`` has 547 robots in four made-up supplies, a
quadrant each, at two shares. Each line has the largest share of a supply's moving robots that move at once before and
after, how much longer that takes, beside the least that moving times leave, and CPU seconds, proof included.
"""

import argparse
import tempfile
from functools import partial
from pathlib import Path

import numpy as np

import fiberplan as fp
from fiberplan.errors import PlanError
from fiberplan.hardware import desi
from fiberplan.hardware.planned import plan_for
from fiberplan.shaping import Staggered, staggered
from hardware import CASES, DATA, problems
from measure import timed

DESI_SHARE = 0.5
SDSS_SHARES = (0.8, 0.5)


def report(what: str, made: Staggered, cpu: float) -> None:
    before, after = max(made.before.values()), max(made.after.values())
    kept = "" if not made.over else f"; NOT KEPT: {', '.join(made.over)}"
    print(
        f"  {what}: at once {before:.3f} before, {after:.3f} after, {np.count_nonzero(made.delay)} wait; "
        f"{made.trajectory.duration - made.longer:.2f} s, {made.longer:.2f} s longer (at least {made.at_least:.2f} s); "
        f"proven {made.certificate.ok}, {cpu:.2f} s of CPU{kept}",
        flush=True,
    )


def petal(seeds: range, data: Path) -> None:
    case, folder = CASES["desi"](data), Path(tempfile.mkdtemp())
    for seed, problem in zip(seeds, problems(case, seeds), strict=True):
        plan = plan_for("desi", fp.planners.Direct(seed=seed, budget=case.budget), problem, calibration=data / "desi")
        without, path = folder / f"{seed}.csv", folder / f"{seed}-power.csv"
        cpu, _, plain = timed(partial(desi.write, plan, without, calibration=data / "desi"))
        try:
            more, _, done = timed(
                partial(desi.write, plan, path, calibration=data / "desi", power=DESI_SHARE)  # what is left on disk ...
            )
        except PlanError as error:
            print(f"  desi, seed {seed}: {error}", flush=True)
            continue
        linear = desi.motors_of(data / "desi").linear
        again = desi.read(path, plan.problem.plane, plan.state_at(0.0), linear=linear)  # ... is what is told of
        facts, length = done.facts, plain.executed.trajectory.duration
        print(
            f"  desi, seed {seed}: {facts['the same without waiting']} before, "
            f"{facts[desi.MOST]} after, {facts['wait for power']} wait; {length:.2f} s, "
            f"{again.trajectory.duration - length:.2f} s longer (at least {facts[desi.LEAST]:.2f} s); "
            f"{done.certificate}; "
            f"{more - cpu:.2f} s of CPU beside {cpu:.2f} s of the export",
            flush=True,
        )


def quadrants(seeds: range, data: Path) -> None:
    case = CASES["sdss"](data)
    x, y = case.plane.base.T
    supplies = [f"quadrant {2 * a + b}" for a, b in zip((x > 0).tolist(), (y > 0).tolist(), strict=True)]
    for seed, problem in zip(seeds, problems(case, seeds), strict=True):
        plan = fp.planners.Direct(seed=seed, budget=case.budget).plan(problem)
        for share in SDSS_SHARES:
            work = partial(staggered, plan.trajectory, problem.plane, supplies, share, margin=case.margin, opening=True)
            cpu, _, made = timed(work)
            report(f"sdss, seed {seed}, share {share:g}", made, cpu)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=("desi", "sdss"))
    parser.add_argument("--fields", type=int, default=3)
    parser.add_argument("--first", type=int, default=0, metavar="SEED", help="of the first field")
    parser.add_argument("--data", type=Path, default=DATA)
    given = parser.parse_args()
    seeds = range(given.first, given.first + given.fields)
    {"desi": petal, "sdss": quadrants}[given.what](seeds, given.data)


if __name__ == "__main__":
    main()
