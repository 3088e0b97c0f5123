"""``fiberplan warmup``: compile ahead, so that the first plan of the night does not wait."""

import time

import typer

from fiberplan.cli.answers import say_json
from fiberplan.cli.options import JsonOption
from fiberplan.cli.output import complain, say, working

MARGIN = 0.8  # [mm]


def warmup(json: JsonOption = False) -> None:
    """Compile every kernel, by planning and proving a field of seven positioners; later runs find them on disk.

    So do other accounts that may read where they are kept. Exit code 1 if they could be kept nowhere.
    """
    begin = time.perf_counter()
    with working("compiling"):
        from fiberplan.focal_plane import FocalPlane
        from fiberplan.planners import Direct, GreedyFold
        from fiberplan.problem import Problem
        from fiberplan.scenes.clustered import clustered_targets

        plane = FocalPlane.hexagonal(1, 22.4)
        targets = clustered_targets(plane, 0, MARGIN)
        problem = Problem.from_targets(plane, targets, margin=MARGIN, conflicts="drop")
        for planner in (GreedyFold(), Direct()):
            planner.plan(problem).faults()

        from fiberplan.kernels.kernel_cache import KernelCache
    if KernelCache.lost:
        complain("kernels were compiled but not kept: no folder for the cache can be written; set NUMBA_CACHE_DIR")
        raise typer.Exit(1)
    seconds = time.perf_counter() - begin
    if json:
        say_json({"seconds": seconds})
    else:
        say(f"kernels ready in {seconds:.1f} s")
