"""What motors that cannot jump cost: fields of plans shaped for their accelerations and least speeds.

Told of each array and planner: CPU of `shape` with its certificate, kernels warm; how many fields are certified at the
planned margin, and how often the planner was asked; makespan paid over the plan whose motors jump; knots a positioner.

Limits: SDSS publishes no acceleration; 48 deg/s^2 is full speed in the 0.25 s that its move-time estimate adds. DESI:
ramps of 22 ms to cruise. MOONS: the driver's rule set 5, 62 to 250 steps in 125 ms, changed by 50 at most.

Usage: python benchmarks/motors.py [--fields N] [--arrays sdss desi moons] [--planners greedy-fold direct]
"""

import argparse
import time
from typing import NamedTuple

import numpy as np

import fiberplan as fp
from fiberplan.problem import Problem
from fiberplan.scenes.uniform import uniform_field
from fiberplan.shaping import plan_for_motors, shape

STEPS = np.array([113.8986, 84.3146])  #: MOONS, alpha and beta [steps/deg]
TICK = 0.125  #: MOONS [s]


class Motors(NamedTuple):
    """What the motors of an array can do, and how many of its positioners are taken, those nearest to its middle."""

    acceleration: np.ndarray  # (2,) [deg/s^2]
    slowest: np.ndarray  # (2,) [deg/s]
    count: int


MOTORS = {
    "sdss": Motors(np.array([48.0, 48.0]), np.zeros(2), 1000),
    "desi": Motors(np.array([8003.0, 8003.0]), np.zeros(2), 500),
    "moons": Motors(50 / STEPS / TICK**2, 62 / STEPS / TICK, 250),
}
PLANNERS = {"greedy-fold": fp.planners.GreedyFold(), "direct": fp.planners.Direct()}


def array(name: str) -> fp.FocalPlane:
    motors, plane = MOTORS[name], fp.FocalPlane.load(name)
    if plane.n > motors.count:
        plane = plane.subset(np.sort(np.argsort(np.hypot(*plane.base.T), kind="stable")[: motors.count]))
    return plane.replace(
        max_acceleration=np.tile(np.radians(motors.acceleration), (plane.n, 1)),
        min_speed=np.tile(np.radians(motors.slowest), (plane.n, 1)),
    )


def field(plane: fp.FocalPlane, seed: int) -> Problem:
    margin = plane.recommended_margin or 0.0
    start = uniform_field(plane, 2 * seed, margin)
    return Problem(plane, start, uniform_field(plane, 2 * seed + 1, margin, start=start), margin)


def row(plane: fp.FocalPlane, planner: fp.planners.Planner, fields: int) -> str:
    cpu, paid, share, asked, knots, safe, lost = [], [], [], [], [], 0, 0
    for seed in range(-1, fields):  # the first is to compile
        problem = field(plane, seed % 1000)
        plan = planner.plan(problem)
        begun = time.process_time()
        shaped = shape(plan.trajectory, plane, problem.margin)
        if seed < 0:
            continue
        cpu.append(time.process_time() - begun)
        made = plan_for_motors(planner, problem) if shaped.lacking else None
        motion = made.trajectory if made else shaped.trajectory
        asked.append(int(made.notes[-1].split()[-2]) if made else 1)
        safe += made.certificate.ok if made else shaped.certificate.ok
        lost += int(plan.kept - made.kept) if made else 0
        paid.append(motion.duration - plan.makespan)
        share.append(100 * paid[-1] / plan.makespan)
        knots.append(np.median(np.diff(motion.offsets)))
    return (
        f"shape {np.median(cpu):.3f} s, worst {max(cpu):.3f}; certified {safe} of {fields}, {lost} more targets lost, "
        f"planned {np.mean(asked):.2f} times, worst {max(asked)}; makespan paid {np.median(paid):.3f} s, "
        f"worst {max(paid):.3f} ({np.median(share):.1f} %, worst {max(share):.1f} %); knots {np.median(knots):.0f}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--fields", type=int, default=50, help="of each array and planner")
    parser.add_argument("--arrays", nargs="+", choices=MOTORS, default=list(MOTORS))
    parser.add_argument("--planners", nargs="+", choices=PLANNERS, default=list(PLANNERS))
    chosen = parser.parse_args()
    for name in chosen.arrays:
        plane = array(name)
        for planner in chosen.planners:
            print(f"{name} {plane.n}, {planner}: {row(plane, PLANNERS[planner], chosen.fields)}", flush=True)


if __name__ == "__main__":
    main()
