"""The paper's outlook: joint speeds in a few bits (`fiberplan.shaping`), on fields of the repaired rule."""

from dataclasses import dataclass

from fiberplan.certificates import verify
from fiberplan.reproductions.makarem2014 import scenes
from fiberplan.reproductions.makarem2014.rules import REPAIRED
from fiberplan.shaping import quantize


@dataclass(frozen=True)
class FewBits:
    """One field in few-bit speeds."""

    n: int
    bits: int
    proven: bool
    on_target: bool  #: all end within the convergence distance
    longer: float  #: motion time in times of that of the plan
    error: float  #: largest tracking error [mm]
    sent: int  #: bits to one positioner


def quantized(rings: int, bits: tuple[int, ...], count: int) -> list[FewBits]:
    """`count` uniform fields in each number of bits."""
    plane, results = scenes.array(rings), []
    for seed in range(count):
        plan = REPAIRED.plan(scenes.uniform(plane, seed))
        for few in bits:
            motion, report = quantize(plan.trajectory, few, plane=plane)
            results.append(
                FewBits(
                    n=plane.n,
                    bits=few,
                    proven=verify(plane, motion).ok,
                    on_target=bool(report.final_error.max() <= REPAIRED.planner.convergence),
                    longer=motion.duration / plan.makespan,
                    error=float(report.tracking_error.max()),
                    sent=report.bits_per_positioner,
                )
            )
    return results
