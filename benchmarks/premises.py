"""Starts, machines and targets as they really are: what is refused, what breaks, and what it costs.

Each row is a premise of a night: arms a little off, arms in contact, a stopped motion, field after field with robots
that fail, calibrations that do not belong to a design, the instruments' own files. A trial is right if its plan is
made, proven, and says of everyone who is lost why; rows tell how many are right, and name the others.

Usage: python benchmarks/premises.py [--only NAME] [--trials N] [--seed FIRST] [--list]
"""

import argparse
import os
import platform
import statistics
import sys
from collections.abc import Callable, Iterator
from fnmatch import fnmatchcase
from pathlib import Path
from typing import NamedTuple

import numpy as np

import fiberplan as fp
from fiberplan.errors import FiberplanError
from measure import calibrated, timed
from scenes import premises

DATA = Path(os.environ.get("FIBERPLAN_DATA", Path(__file__).parents[2] / "shared" / "data"))


class Row(NamedTuple):
    """A premise, and how often it is tried."""

    name: str
    trial: Callable[[int, Path], premises.Trial]  #: of a seed and the folder of real data
    trials: int
    needs: str | None = None  #: path in the folder of real data without which there is no row


ROWS = (
    Row("disturbed-0.1", premises.disturbed(0.1), 50),
    Row("disturbed-0.3", premises.disturbed(0.3), 50),
    Row("touching", premises.touching, 200),
    Row("stopped", premises.stopped, 50),
    Row("chain-sdss", premises.chain("sdss"), 20),
    Row("chain-desi-petal", premises.chain("desi-petal"), 20, premises.DESI),
    Row("chain-pfs", premises.chain("pfs"), 20),
    Row("sdss-design", premises.design_on("right folder"), 1, premises.DESIGN),
    Row("sdss-wrong-site", premises.design_on("wrong site"), 1, premises.DESIGN),
    Row("sdss-built-in", premises.design_on("built-in"), 1, premises.DESIGN),
    Row("pfs-folded", premises.pfs_folded, 5),
    Row("desi-field", premises.desi_field, 5, premises.DESI),
    Row("desi-load", premises.desi_load, 5, premises.DESI),
)


def tried(row: Row, seed: int) -> tuple[float, premises.Trial]:
    """CPU seconds and what came of one trial."""
    try:
        cpu, _, trial = timed(lambda: row.trial(seed, DATA))
    except FiberplanError as error:
        return 0.0, premises.Trial(False, f"refused: {error}")
    return (cpu if trial.cpu is None else trial.cpu), trial


def lines_of(row: Row, seeds: range) -> Iterator[str]:
    """The row of the table, then a line for each trial that is not right, and for what there is to say."""
    results = [(seed, *tried(row, seed)) for seed in seeds]
    right = sum(trial.right for _, _, trial in results)
    cpu = [seconds for _, seconds, _ in results]
    yield (
        f"{row.name:<18} {right:>4} of {len(results):<4} right   CPU median {statistics.median(cpu):8.3f} s, "
        f"worst {max(cpu):8.3f} s   {sum(trial.lost for _, _, trial in results)} lost by name"
    )
    for seed, _, trial in results:
        if not trial.right or trial.said:
            yield f"    seed {seed}: {'' if trial.right else 'WRONG: '}{trial.said}"


def main(arguments: list[str] | None = None) -> int:
    """Print the table; 1 if a trial is not right, 2 if an option cannot be used."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--only", action="append", default=[], metavar="NAME", help="rows, with * and ?; repeatable")
    parser.add_argument("--trials", type=int, help="of each row; as many as the figures ask for unless given")
    parser.add_argument("--seed", type=int, default=0, help="of the first trial")
    parser.add_argument("--list", action="store_true", help="list the rows")
    options = parser.parse_args(arguments)
    rows = [row for row in ROWS if not options.only or any(fnmatchcase(row.name, p) for p in options.only)]
    if not rows:
        print(f"no row of that name; there are {', '.join(row.name for row in ROWS)}", file=sys.stderr)
        return 2
    if options.list:
        print("\n".join(row.name for row in rows))
        return 0
    print(f"Python {platform.python_version()}, numpy {np.__version__}, fiberplan {fp.__version__}, one core")
    print(f"calibration: 10^8 segment distances in {calibrated(1):.2f} s CPU\n", flush=True)
    wrong = False
    for row in rows:
        if row.needs and not (DATA / row.needs).exists():
            print(f"{row.name:<18} skipped: no {DATA / row.needs}", flush=True)
            continue
        count = row.trials if options.trials is None else min(options.trials, row.trials)
        for line in lines_of(row, range(options.seed, options.seed + count)):
            wrong |= "WRONG: " in line
            print(line, flush=True)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
