"""Is this commit slower than another one? Every planner and `verify`, timed on both in turn.

The other commit is checked out into a temporary git worktree. Each case is timed in two child processes, one for each
commit, that answer in turn: neighbouring moments share what else the machine does, so their ratio says more than two
runs do. CPU time, kernels warm; each round is once here and once there, and who is first alternates.

Usage: python benchmarks/pairs.py COMMIT [--rounds N] [--case NAME]
"""

import argparse
import itertools
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
CACHE = ".pairs"  # of compiled kernels, within each tree
LEAST = 0.15  # [s] of work in a timing: a case that is quicker is repeated


def cases() -> dict[str, Callable[[], Callable[[], Any]]]:
    """Name -> what makes the work that is timed; nothing newer than the oldest commit compared may be used."""
    import numpy as np

    import fiberplan as fp

    try:
        from fiberplan.scenes.uniform import uniform_field
    except ImportError:  # before the rooms were moved
        from fiberplan.fields import uniform_field  # type: ignore[no-redef, import-not-found]

    def problem(plane: fp.FocalPlane, margin: float) -> fp.Problem:
        return fp.Problem(plane, uniform_field(plane, 0, margin), uniform_field(plane, 1, margin), margin)

    def sayres() -> fp.Problem:
        return problem(fp.FocalPlane.load("sayres2021"), 1.0)

    def planned(planner: Any, asked: fp.Problem) -> Callable[[], Any]:
        return lambda: planner.plan(asked)

    def proof(asked: fp.Problem) -> Callable[[], Any]:
        motion = fp.planners.GreedyFold(step=np.radians(1.0)).plan(asked).trajectory
        return lambda: fp.verify(asked.plane, motion, asked.margin)

    def outlined(name: str, margin: float) -> fp.Problem:
        """The first 500 of an array whose bodies are outlines."""
        return problem(fp.FocalPlane.load(name).subset(np.arange(500)), margin)

    def crowded() -> Callable[[], Any]:
        """Ten moves of 547 arms at a buffer of 2.5 mm, of which a few take long."""
        plane = fp.FocalPlane.load("sayres2021")
        fields = [uniform_field(plane, seed, 2.0) for seed in range(11)]
        moves = [fp.Problem(plane, *ends, 2.0) for ends in itertools.pairwise(fields)]
        return lambda: [fp.planners.Direct().plan(move) for move in moves]

    desi = {"lengths": (3.0, 3.0), "radius": 0.9, "max_speed": np.radians([180.0, 120.0])}
    return {
        "verify": lambda: proof(sayres()),
        "greedy-fold": lambda: planned(fp.planners.GreedyFold(step=np.radians(1.0)), sayres()),
        "direct": lambda: planned(fp.planners.Direct(), problem(fp.FocalPlane.hexagonal(6, 22.4), 1.0)),
        "navigation-function": lambda: planned(
            fp.planners.NavigationFunction(), problem(fp.FocalPlane.hexagonal(8, 10.0, **desi), 0.2)
        ),
        "elliptic-navigation-function": lambda: planned(
            fp.planners.EllipticNavigationFunction(), problem(fp.FocalPlane.hexagonal(4, 22.4), 0.5)
        ),
        "prioritized-roadmap": lambda: planned(
            fp.planners.PrioritizedRoadmap(early_abort=True), problem(fp.FocalPlane.load("miradas"), 0.5)
        ),
        "verify desi": lambda: proof(outlined("desi", 0.1)),
        "verify moons": lambda: proof(outlined("moons", 0.1)),
        "direct 547": crowded,
        "direct desi": lambda: planned(fp.planners.Direct(), outlined("desi", 0.1)),
        "direct moons": lambda: planned(fp.planners.Direct(), outlined("moons", 0.1)),
    }


def answer(name: str) -> None:
    """Time the case once for every line that comes in: the work of a child process."""
    work = cases()[name]()
    for _ in range(2):  # compile, and see how long it takes
        begun = time.process_time()
        work()
        once = time.process_time() - begun
    repeats = max(1, round(LEAST / max(once, 1e-4)))
    print(json.dumps(repeats), flush=True)
    for line in sys.stdin:
        count = int(line)
        begun = time.process_time()
        for _ in range(count):
            work()
        print(json.dumps((time.process_time() - begun) / count), flush=True)


class Child:
    """A process that times one case on one commit."""

    def __init__(self, name: str, tree: Path):
        environment = os.environ | {"PYTHONPATH": str(tree / "src"), "NUMBA_CACHE_DIR": str(tree / CACHE)}
        command = [sys.executable, __file__, "--answer", name]
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True, env=environment)
        self.repeats = int(self._read())

    def seconds(self, repeats: int) -> float:
        """CPU of the case once, mean of `repeats` [s]."""
        assert self._process.stdin is not None
        print(repeats, file=self._process.stdin, flush=True)
        return self._read()

    def close(self) -> None:
        """Let it end."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait()

    def _read(self) -> float:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            raise SystemExit(f"the child process ended: {' '.join(map(str, self._process.args))}")
        return float(json.loads(line))


def compared(name: str, trees: list[Path], rounds: int) -> str:
    """A row of the table: here over there, CPU times and their ratios."""
    children = [Child(name, tree) for tree in trees]
    repeats = children[0].repeats
    times: list[list[float]] = [[], []]
    for k in range(rounds):
        for side in (0, 1) if k % 2 else (1, 0):
            times[side].append(children[side].seconds(repeats))
    for child in children:
        child.close()
    ratios = sorted(here / there for here, there in zip(*times, strict=True))
    low, high = ratios[len(ratios) // 4], ratios[-1 - len(ratios) // 4]
    here, there = (1e3 * statistics.median(own) for own in times)
    least = min(times[0]) / min(times[1])
    return f"{name:<28} {here:10.2f} {there:10.2f} {statistics.median(ratios):8.3f} {low:8.3f} {high:8.3f} {least:8.3f}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("commit", nargs="?", help="what this commit is compared with")
    parser.add_argument("--rounds", type=int, default=31, help="pairs of timings of a case")
    parser.add_argument("--case", action="append", default=[], metavar="NAME", help="only these")
    parser.add_argument("--answer", metavar="NAME", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.answer:
        answer(options.answer)
        return
    known = list(cases())
    if options.commit is None or options.rounds < 1:
        parser.error("a commit to compare with is needed, and at least one round")
    if not set(options.case) <= set(known):
        parser.error(f"the cases are {', '.join(known)}")
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / "base"
        git = ["git", "-C", str(ROOT), "worktree"]
        made = subprocess.run([*git, "add", "--detach", str(tree), options.commit], capture_output=True, text=True)
        if made.returncode:
            parser.error(made.stderr.strip().splitlines()[-1])
        try:
            heads = ("here [ms]", "base [ms]", "median", "lower", "upper", "of least")
            print(f"{'case':<28} " + " ".join(f"{head:>{10 if k < 2 else 8}}" for k, head in enumerate(heads)))
            for name in options.case or known:
                print(compared(name, [ROOT, tree], options.rounds), flush=True)
        finally:
            subprocess.run([*git, "remove", "--force", str(tree)], check=False, capture_output=True)


if __name__ == "__main__":
    main()
