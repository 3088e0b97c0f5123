"""A survey on a Dask cluster: the script of docs/slurm.md, with a local cluster in the place of Slurm's.

A worker is killed on the way; the files are then compared with those of one process.

Usage: python benchmarks/survey_dask.py [--fields N] [--workers N]
"""

import argparse
import os
import signal
import tempfile
import time
from pathlib import Path

from distributed import Client, LocalCluster

import fiberplan as fp
from survey_runs import contents, small_survey


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fields", type=int, default=24)
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    survey = small_survey(options.fields)
    with tempfile.TemporaryDirectory() as folder:
        alone, clustered = Path(folder) / "alone", Path(folder) / "clustered"
        fp.survey.run(*survey.inputs, alone, at_once=1, **survey.settings)
        cluster = LocalCluster(n_workers=options.workers, threads_per_worker=1, dashboard_address=None)
        with cluster, Client(cluster) as client:
            killed = []

            def told(how_far: str) -> None:
                if not killed:
                    killed.append(next(iter(client.run(os.getpid).values())))
                    os.kill(killed[0], signal.SIGKILL)
                print(f"\r{how_far}, worker {killed[0]} killed after the first", end="", flush=True)

            begun = time.perf_counter()
            executor = client.get_executor(pure=False)
            many = 2 * options.workers
            done = fp.survey.run(*survey.inputs, clustered, executor, at_once=many, report=told, **survey.settings)
            print(f"\n{done}\n{time.perf_counter() - begun:.1f} s wall with {options.workers} workers")
        same = contents(alone) == contents(clustered)
        print("files are those of one process" if same else "FILES DIFFER")
        raise SystemExit(0 if same and not done.failed else 1)


if __name__ == "__main__":
    main()
