"""What pictures of a plan cost: every kind of figure, films, and what notebooks show, on the SDSS array with obstacles.

The plan goes from one clustered field to another, margin 0.8 mm. CPU is of one core, kernels warm, the proof made
before; of a film also that of the encoder, a process of its own.

Usage: python benchmarks/visuals.py [--frames N] [--size PIXELS]
"""

import argparse
import resource
import tempfile
from pathlib import Path

import numpy as np

import fiberplan as fp
from measure import peak_memory, timed

MARGIN = 0.8  # [mm]
FPS = 30.0


def planned() -> fp.Plan:
    """From field to field, as `fiberplan demo` plans it."""
    plane = fp.FocalPlane.load("sdss")
    fields = [fp.scenes.clustered_targets(plane, seed, MARGIN) for seed in (0, 1)]
    first = fp.Problem.from_targets(plane, fields[0], margin=MARGIN, conflicts="drop")
    here = fp.planners.GreedyFold(step=np.radians(1.0)).plan(first).trajectory.end
    return fp.planners.Direct().plan(
        fp.Problem.from_targets(plane, fields[1], start=here, margin=MARGIN, conflicts="drop")
    )


def encoding() -> float:
    """CPU seconds of the processes that this one started and that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--frames", type=int, default=300, help="of the film, at 30 a second")
    parser.add_argument("--size", type=int, default=1000, help="of the film [pixel]")
    options = parser.parse_args()
    plan = planned()
    print(f"{plan.problem.plane.name}, {plan.problem.n} positioners: {plan}; {plan.certificate}")
    with tempfile.TemporaryDirectory() as folder:
        for kind in fp.visuals.FIGURES:
            path = Path(folder) / f"{kind}.svg"
            fp.visuals.draw(plan, kind, path)  # fonts are found once
            cpu, _, _ = timed(lambda kind=kind, path=path: fp.visuals.draw(plan, kind, path))
            print(f"{kind:12s} {cpu:6.2f} s {path.stat().st_size / 1e3:8.0f} kB")
        for suffix in ("mp4", "gif"):
            path, before = Path(folder) / f"film.{suffix}", encoding()
            speed = plan.makespan * FPS / options.frames
            cpu, wall, _ = timed(
                lambda path=path, speed=speed: fp.visuals.animate(plan, path, FPS, speed, options.size)
            )
            others = encoding() - before
            print(f"{suffix:12s} {cpu:6.2f} s + {others:.2f} s of the encoder, {wall:.1f} s in all", end=" ")
            print(f"{path.stat().st_size / 1e3:.0f} kB")
    for name, thing in (("plan", plan), ("focal plane", plan.problem.plane), ("certificate", plan.certificate)):
        cpu, _, shown = timed(thing._repr_html_)
        print(f"{name:12s} {cpu:6.2f} s {len(shown) / 1e3:8.1f} kB of HTML, repr {len(repr(thing))} letters")
    print(f"peak memory {peak_memory():.0f} MiB")


if __name__ == "__main__":
    main()
