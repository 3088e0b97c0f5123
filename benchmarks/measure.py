"""What every benchmark measures with: CPU time, peak memory, and a loop that lets machines compare."""

import resource
import statistics
import time
from collections.abc import Callable
from typing import TypeVar

import numpy as np

from fiberplan.kernels.compile import kernel
from fiberplan.kernels.segments import segment_to_segment

SEGMENTS = 10**8

T = TypeVar("T")


@kernel
def calibration(x, count):
    """`count` segment distances [mm^2], summed so that none can be left out."""
    total = 0.0
    for k in range(count):
        a, b = x[k & 7], x[(k + 3) & 7]
        d2, _, _ = segment_to_segment(0.0, 0.0, a, 1.0, b, 2.0, 3.0, a + b)
        total += d2
    return total


def timed(work: Callable[[], T]) -> tuple[float, float, T]:
    """CPU seconds, wall seconds and result of `work`."""
    wall, cpu = time.perf_counter(), time.process_time()
    result = work()
    return time.process_time() - cpu, time.perf_counter() - wall, result


def calibrated(loops: int) -> float:
    """CPU seconds of 10^8 segment distances, median of `loops`: the same work everywhere."""
    x = np.random.default_rng(0).random(8)
    calibration(x, 10)
    return statistics.median(timed(lambda: calibration(x, SEGMENTS))[0] for _ in range(loops))


def peak_memory() -> float:
    """Peak resident memory of this process so far [MiB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
