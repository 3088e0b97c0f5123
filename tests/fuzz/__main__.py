"""Run campaigns until the time is up; every failure is named by what repeats it, and kept for `make test`."""

import argparse
import sys
import tempfile
import time
import traceback
from pathlib import Path

import numpy as np

from fuzz.campaigns import CAMPAIGNS
from fuzz.corpus import FOLDER, keep


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="fuzz", description=__doc__)
    parser.add_argument("--only", action="append", choices=CAMPAIGNS, help="a campaign; repeat for more")
    parser.add_argument("--seed", type=int, default=0, help="the first; others follow")
    parser.add_argument("--count", type=int, help="seeds per campaign; as many as there is time for unless given")
    parser.add_argument("--seconds", type=float, default=180.0, help="of all campaigns together")
    parser.add_argument("--keep", type=Path, default=FOLDER, help="a folder for what is found: a file for each")
    options = parser.parse_args(arguments)
    names = options.only or list(CAMPAIGNS)
    failures = 0
    for name in names:
        ends = time.monotonic() + (options.seconds / len(names) if options.count is None else np.inf)
        seed = options.seed
        while time.monotonic() < ends and (options.count is None or seed < options.seed + options.count):
            failures += not holds(name, seed, options.keep)
            seed += 1
        print(f"{name}: {seed - options.seed} seeds from {options.seed}", flush=True)
    print(f"{failures} failures")
    return int(failures > 0)


def holds(name: str, seed: int, kept: Path) -> bool:
    """Whether nothing is found with this seed; what is found is printed, and kept in a folder."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            CAMPAIGNS[name](np.random.default_rng(seed), Path(folder))
        except Exception as error:
            traceback.print_exc()
            path = keep(kept, name, seed, "".join(traceback.format_exception_only(error)).splitlines()[0])
            print(f"found: --only {name} --seed {seed} --count 1; kept as {path}", flush=True)
            return False
    return True


if __name__ == "__main__":
    sys.exit(main())
