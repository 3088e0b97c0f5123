"""What a target of opportunity costs: random new goals for random positioners of certified plans of 547.

CPU is that of `amend` and the certificate of the whole, kernels warm. A goal that touches another goal is refused and
drawn again; of the rest it is told how many are not kept, how many positioners move otherwise, and whether it takes
longer.

Usage: python benchmarks/amend.py [--count N]
"""

import argparse
import time

import numpy as np

import fiberplan as fp
from fiberplan.errors import ProblemError
from fiberplan.scenes.uniform import uniform_field

MARGINS = (0.0, 1.0, 2.0)  # [mm]: buffers of 1.5, 2.0 and 2.5
SEED = 1
PLANNERS = {"greedy-fold": fp.planners.GreedyFold(step=np.radians(1.0)), "direct": fp.planners.Direct()}


def moved(before: fp.Plan, after: fp.Plan) -> int:
    """How many positioners do not have exactly the knots they had."""
    old, new = before.trajectory, after.trajectory
    count = 0
    for i in range(old.n):
        a, b = slice(*old.offsets[i : i + 2]), slice(*new.offsets[i : i + 2])
        same = np.array_equal(old.times[a], new.times[b]) and np.array_equal(old.angles[a], new.angles[b])
        count += not same
    return count


def row(plan: fp.Plan, count: int) -> str:
    plane, rng = plan.problem.plane, np.random.default_rng(0)
    assert plan.certificate.ok
    cpu, others, longest, lost, refused = [], [], 1.0, 0, 0
    while len(cpu) < count:
        i = int(rng.integers(plane.n))
        goal = plane.kinematics.random(plane, rng, np.array([i]))[0]
        begun = time.process_time()
        try:
            new = fp.planners.amend(plan, i, goal)
        except ProblemError:
            refused += 1
            continue
        assert new.certificate.ok
        cpu.append(1e3 * (time.process_time() - begun))
        others.append(moved(plan, new))
        longest = max(longest, new.makespan / plan.makespan)
        lost += new.outcomes[i] is not fp.Outcome.ARRIVED
    times = f"median {np.median(cpu):.1f}, 90 % {np.percentile(cpu, 90):.1f}, worst {max(cpu):.0f} ms"
    return f"{times}; not kept {lost} of {count} ({refused} refused); moved {np.bincount(others)}; x {longest:.3f}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=80, help="goals that are not refused, per plan")
    count = parser.parse_args().count
    plane = fp.FocalPlane.load("sayres2021")
    for margin in MARGINS:
        start, goal = uniform_field(plane, SEED, margin), uniform_field(plane, SEED + 100, margin)
        for name, planner in PLANNERS.items():
            plan = planner.plan(fp.Problem(plane, start, goal, margin))
            row(plan, 1)  # warm
            print(f"margin {margin:g} mm, {name} ({plan}): {row(plan, count)}", flush=True)


if __name__ == "__main__":
    main()
