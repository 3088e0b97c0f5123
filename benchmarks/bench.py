"""The figures of the README: GreedyFold and verify, from 547 to 100,000 positioners, on one core.

Each figure is measured on this run, with the kernels warm: CPU (median of several fields, best and worst), wall time
(median), and peak memory of the process so far. The calibration loop is the same work everywhere, so that runs on
different machines compare.

Usage: python benchmarks/bench.py [--quick] [--json FILE]
"""

import argparse
import json
import platform
import statistics
from pathlib import Path

import numpy as np

import fiberplan as fp
from fiberplan.scenes.uniform import uniform_field
from measure import calibrated, peak_memory, timed

RINGS = {547: 13, 4_921: 40, 19_927: 81, 99_919: 182}


def array(n: int) -> fp.FocalPlane:
    """A filled hexagon of Sayres2021's positioners."""
    return fp.FocalPlane.load("sayres2021") if n == 547 else fp.FocalPlane.hexagonal(RINGS[n], 22.4)


def fold_row(plane: fp.FocalPlane, step: float, margin: float, seeds: int) -> dict:
    """Fold times over several uniform fields: whole plans from folded, their walks alone, and their proofs."""
    rows: dict[str, list[float]] = {key: [] for key in ("cpu", "wall", "walk", "verify", "knots", "makespan")}
    lost = unproven = 0
    for seed in range(seeds):
        problem = fp.Problem(plane, plane.folded, uniform_field(plane, seed, margin), margin)
        cpu, wall, plan = timed(lambda p=problem: fp.planners.GreedyFold(step=step).plan(p))
        proof, _, certificate = timed(lambda p=plan, m=margin: fp.verify(plane, p.trajectory, m))
        lost, unproven = lost + len(plan.lost), unproven + (not certificate.ok)
        values = (cpu, wall, plan.timings["walk"], proof, len(plan.trajectory.times) / plane.n, plan.makespan)
        for key, value in zip(rows, values, strict=True):
            rows[key].append(value)
    medians = {key: statistics.median(values) for key, values in rows.items()}
    return {
        "positioners": plane.n,
        "step [deg]": float(round(np.degrees(step), 4)),
        "buffer [mm]": 1.5 + margin / 2,
        "fields": seeds,
        "plan CPU [ms]": 1e3 * medians["cpu"],
        "plan CPU best [ms]": 1e3 * min(rows["cpu"]),
        "plan CPU worst [ms]": 1e3 * max(rows["cpu"]),
        "plan wall [ms]": 1e3 * medians["wall"],
        "walk CPU [ms]": 1e3 * medians["walk"],
        "verify CPU [ms]": 1e3 * medians["verify"],
        "plan per positioner [us]": 1e6 * medians["cpu"] / plane.n,
        "knots": medians["knots"],
        "makespan [s]": medians["makespan"],
        "lost": lost,
        "not proven": unproven,
        "peak memory [MiB]": peak_memory(),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="fewer fields, up to 5,000 positioners")
    parser.add_argument("--json", type=Path, help="also write the rows to this file")
    options = parser.parse_args()

    loop = calibrated(1 if options.quick else 3)
    small = array(547)
    warm = fp.Problem(small, small.folded, uniform_field(small, 0, 1.0), 1.0)
    fp.planners.GreedyFold(step=np.radians(1.0)).plan(warm).certificate  # noqa: B018 compiles every kernel
    print(f"Python {platform.python_version()}, numpy {np.__version__}, {platform.machine()}")
    print(f"calibration: 10^8 segment distances in {loop:.2f} s CPU\n")

    seeds = 5 if options.quick else 21
    rows = [fold_row(small, np.radians(step), 0.0, seeds) for step in (1.0, 0.1)]
    rows.append(fold_row(small, np.radians(0.01), 0.0, 3 if options.quick else 7))
    rows += [fold_row(small, np.radians(1.0), margin, seeds) for margin in (1.0, 2.0, 3.0)]
    for n in (4_921,) if options.quick else (4_921, 19_927, 99_919):
        rows.append(fold_row(array(n), np.radians(1.0), 0.0, 5 if n < 50_000 else 3))

    names = list(rows[0])
    print(" | ".join(names))
    for row in rows:
        print(" | ".join(f"{row[name]:.4g}" for name in names))
    if options.json:
        options.json.write_text(json.dumps({"calibration [s]": loop, "rows": rows}, indent=1))


if __name__ == "__main__":
    main()
