"""NavigationFunction from 7 to 100,000 positioners of makarem2014, on one core: time, motion, arrivals, proof, memory.

Usage: python benchmarks/navigation.py [FIELDS]
"""

import resource
import sys
import time

import numpy as np

import fiberplan as fp
from fiberplan.reproductions.makarem2014 import scenes

RINGS = (1, 2, 3, 5, 8, 11, 15, 20, 28, 40)


def measured(plane: fp.FocalPlane, seeds: range, mode: str) -> str:
    times, motions, lost, unproven = [], [], 0, 0
    for seed in seeds:
        problem = scenes.uniform(plane, seed)
        begun = time.process_time()
        plan = fp.planners.NavigationFunction(mode=mode).plan(problem)
        times.append(time.process_time() - begun)
        motions.append(plan.makespan)
        lost, unproven = lost + len(plan.lost), unproven + (not plan.certificate.ok)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    speed = f"CPU {np.median(times):7.3f} s (most {max(times):.3f})"
    motion = f"motion {np.median(motions):5.2f} s (mean {np.mean(motions):.2f}, most {max(motions):.2f})"
    result = f"lost {lost} of {plane.n * len(times)}, not proven {unproven} of {len(times)}"
    return f"{mode:8} N {plane.n:6}: {speed}, {motion}, {result}, {memory:.0f} MiB"


if __name__ == "__main__":
    fields = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    for mode in ("repaired", "literal"):
        measured(scenes.array(1), range(1), mode)  # compiles the kernels
        for rings in RINGS:
            print(measured(scenes.array(rings), range(fields), mode), flush=True)
        print(measured(scenes.array(182), range(1), mode), flush=True)
