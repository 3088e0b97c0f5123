"""Every planner on every scene: who arrives, how near the bound, in what time, and whether it is proven.

Each figure is measured on this run, on one core: CPU with the kernels warm, peak memory of the process so far. How to
read the table and how to add a planner or a scene: docs/benchmark.md.

Usage: python benchmarks/planners.py [--scene NAME] [--planner NAME] [--fields N | --seed K] [--quick] [--json FILE]
"""

import argparse
import json
import os
import platform
import sys
from collections.abc import Callable, Iterable
from dataclasses import asdict
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np

from fiberplan.errors import FiberplanError
from fiberplan.planners import PLANNERS
from fiberplan.tables.atomic import write_whole
from measure import calibrated
from runs import Run, run, summary
from scenes import SCENES, Scene
from settings import LARGEST, settings

QUICK_FIELDS = 2
DATA = Path(os.environ.get("FIBERPLAN_DATA", Path(__file__).parents[2] / "shared" / "data"))


def chosen(patterns: Iterable[str], known: Iterable[str], what: str) -> list[str]:
    """The names that fit any of `patterns` (with * and ?), or all.

    Raises:
        SystemExit: a pattern that fits none; exit code 2 after one line.
    """
    names, patterns = list(known), list(patterns)
    for pattern in patterns:
        if not any(fnmatchcase(name, pattern) for name in names):
            print(f"no {what} '{pattern}'; there are {', '.join(names)}", file=sys.stderr)
            raise SystemExit(2)
    return [name for name in names if not patterns or any(fnmatchcase(name, p) for p in patterns)]


def seeds_of(scene: Scene, options: argparse.Namespace) -> list[int]:
    """The fields of a scene that are asked for."""
    asked = options.seed or range(options.fields or (QUICK_FIELDS if options.quick else scene.fields))
    return [seed for seed in asked if not scene.finite or seed < scene.fields]


def main(arguments: list[str] | None = None) -> int:
    """Print the table; 1 if a plan is missing or not proven, 2 if an option cannot be used."""
    options = parsed(arguments)
    names = chosen(options.scene, SCENES, "scene")
    if options.list:
        for name in names:
            print(f"{name:<22} {SCENES[name].summary}")
        return 0
    scenes = [SCENES[name] for name in names if SCENES[name].quick or not options.quick]
    planners = chosen(options.planner, PLANNERS, "planner")
    report: dict[str, Any] = {"python": platform.python_version(), "machine": platform.machine(), "rows": []}
    write_json(options.json, report)
    report |= {"calibration [s]": calibrated(1 if options.quick else 3)}
    print(f"Python {report['python']}, numpy {np.__version__}, {report['machine']}")
    print(f"calibration: 10^8 segment distances in {report['calibration [s]']:.2f} s CPU\n")
    warm(planners, options.data)

    failures: list[str] = []
    table = Table()
    for scene in scenes:
        if (path := scene.missing(options.data)) is not None:
            print(f"{scene.name}: skipped, no {path} (--data, or FIBERPLAN_DATA, says where real data are)")
            continue
        seeds = seeds_of(scene, options)
        if not seeds:
            print(f"{scene.name}: skipped, it has fields 0 to {scene.fields - 1} only")
            continue
        for name in planners:
            if (why := too_large(name, scene, options.data)) is not None:
                print(f"{scene.name}, {name}: skipped, {why}")
                continue
            runs: list[Run] = []
            for seed in seeds:
                runs.append(plan_field(name, scene, seed, options.data, options.deadline, options.prove))
                done = {"scene": scene.name, "planner": name, "summary": summary(runs)}
                done["runs"] = [asdict(r) for r in runs]
                write_json(options.json, report | {"rows": [*report["rows"], done]})
            report["rows"].append(done)
            table.show({"scene": scene.name, "planner": name} | summary(runs))
            failures += [f"{scene.name}, {name}, seed {r.seed}: {why}" for r in runs for why in wrong(r)]
    print("".join(f"\n{line}" for line in failures))
    return 1 if failures else 0


def plan_field(
    name: str, scene: Scene, seed: int, data: Path, deadline: float | None = None, prove: float | None = None
) -> Run:
    """One field of a scene, planned as the table plans it; a field that cannot be made says why."""
    try:
        problem = scene.make(seed, data)
    except (FiberplanError, ValueError) as error:
        return Run(seed, refused=f"no such field: {error}")
    return run(seed, problem, PLANNERS[name](**settings(name, problem.plane)), deadline, prove and np.radians(prove))


def too_large(name: str, scene: Scene, data: Path) -> str | None:
    """Why a planner is spared a scene, if it is."""
    if name not in LARGEST or (count := scene.make(0, data).n) <= LARGEST[name]:
        return None
    return f"{count} positioners: it gets at most {LARGEST[name]}"


def warm(planners: list[str], data: Path) -> None:
    """Run each planner on the small scenes, so that its kernels are compiled or loaded."""
    for scene in SCENES.values():
        for name in planners:
            if scene.quick and too_large(name, scene, data) is None:
                plan_field(name, scene, 0, data)


def wrong(done: Run) -> list[str]:
    """What makes a run a failure: losses do not, they are in the table."""
    crashed = [f"crashed: {done.crashed}"] if done.crashed else []
    refused = [f"refused: {done.refused}"] if done.refused else []
    return [*crashed, *refused, *(f"not certified: {fault}" for fault in done.faults)]


class Table:
    """Rows printed as they come, under headings as wide as they need to be."""

    def __init__(self) -> None:
        self._headed = False

    def show(self, row: dict[str, Any]) -> None:
        """Print one row, and before the first the headings."""
        widths = {name: max(len(name), {"scene": 21, "planner": 12}.get(name, 6)) for name in row}
        if not self._headed:
            print("  ".join(name.rjust(width) for name, width in widths.items()))
            self._headed = True
        print("  ".join(_text(row[name]).rjust(width) for name, width in widths.items()), flush=True)


def _text(value: Any) -> str:
    if value is None:
        return "-"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def write_json(path: Path | None, report: dict[str, Any]) -> None:
    """Write a report whole or not at all.

    Raises:
        SystemExit: the file cannot be written; exit code 2 after one line.
    """
    if path is None:
        return
    try:
        write_whole(path, json.dumps(report, indent=1).encode(), FiberplanError)
    except FiberplanError as error:
        print(error, file=sys.stderr)
        raise SystemExit(2) from None


def parsed(arguments: list[str] | None) -> argparse.Namespace:
    """The options, or exit code 2."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scene", action="append", default=[], metavar="NAME", help="only these; * and ? fit any")
    parser.add_argument("--planner", action="append", default=[], metavar="NAME", help="only these; * and ? fit any")
    parser.add_argument("--fields", type=_from(1), metavar="N", help="seeds 0 to N - 1 of every scene")
    parser.add_argument("--seed", type=_from(0), action="append", metavar="K", help="only these seeds")
    parser.add_argument("--quick", action="store_true", help="only the small scenes, two fields of each")
    parser.add_argument("--data", type=Path, default=DATA, metavar="FOLDER", help="real focal planes and designs")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write every run to this file")
    parser.add_argument("--deadline", type=float, metavar="S", help="for planners that take one, of wall-clock time")
    parser.add_argument(
        "--prove", type=float, metavar="DEG", help="prove what pairs need, in steps of so much: 2, or 3"
    )
    parser.add_argument("--list", action="store_true", help="only list the scenes")
    return parser.parse_args(arguments)


def _from(least: int) -> Callable[[str], int]:
    """A reader of whole numbers of `least` or more."""

    def number(text: str) -> int:
        if not text.isdecimal() or int(text) < least:
            raise argparse.ArgumentTypeError(f"must be a whole number of {least} or more, got '{text}'")
        return int(text)

    return number


if __name__ == "__main__":
    sys.exit(main())
