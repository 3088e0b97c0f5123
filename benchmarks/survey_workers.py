"""Two workers against one: wall-clock and CPU seconds, and what the order of fields leaves of two.

For four regions of the sky that share no targets, and for one whose fields overlap one after the other. Wall-clock
times say little on a machine that is busy, so what other work it did is told beside them; what CPU seconds would come
to in the order in which fields wait for each other; and wall-clock times of workers that sleep as long as fields took.

Usage: python benchmarks/survey_workers.py [--fields N] [--rounds N] [--full] [--regions N ...] [--awake]
"""

import argparse
import heapq
import os
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import fiberplan as fp
from fiberplan.survey import Fields, SurveyTargets
from fiberplan.survey.batch.precedence import Precedence
from fiberplan.survey.batch.workers import Here
from survey_runs import Case, contents, cpu_seconds, sayres_survey, small_survey


def speed_up(fields: int, rounds: int, full: bool, regions_of_the_sky: list[int], awake: bool) -> None:
    """Two processes and one, in turn, each with kernels that are compiled."""
    made = sayres_survey if full else (lambda fields, regions: small_survey(fields, 4, 8.0, regions))
    for regions in regions_of_the_sky:
        case = made(fields, regions)
        robots = case.inputs[0].n
        print(f"speed-up: {fields} fields of {robots} robots, regions that share no targets: {regions}", flush=True)
        ratios, same = [], []
        for _ in range(rounds):
            wall, cpu, files, seconds = {}, {}, {}, {}
            for many in (2, 1):
                with tempfile.TemporaryDirectory() as folder:
                    used, busy, begun = cpu_seconds(), _busy(), time.perf_counter()
                    done = fp.survey.run(*case.inputs, folder, at_once=many, **case.settings)
                    wall[many] = time.perf_counter() - begun
                    cpu[many], busy = cpu_seconds() - used, _busy() - busy
                    files[many] = contents(Path(folder))
                seconds[many] = [record.times[0] for record in done.records]
                print(
                    f"          {many} at once: {wall[many]:6.1f} s wall, {cpu[many]:6.1f} s CPU, of which fields "
                    f"{sum(seconds[many]):.1f}; other work kept {max(0.0, busy - cpu[many]) / wall[many]:.2f} of "
                    f"{os.cpu_count()} cores busy",
                    flush=True,
                )
            ratios.append(round(wall[1] / wall[2], 2))
            same.append(files[1] == files[2])
        each = (cpu[2] - sum(seconds[2])) / fields  # CPU of starts, ledger and driver, as if it were the fields'
        free = cpu[1] / _scheduled(case, [one + each for one in seconds[2]], 2)
        print(f"          ratio of wall {ratios}; of CPU seconds, in the order in which fields wait, {free:.2f}")
        print(f"          {'same bytes' if all(same) else 'FILES DIFFER'}, recorded times aside", flush=True)
        if not awake:
            asleep(case)


class Recorded(Here):
    """This process, and what it did, by number of field."""

    def __init__(self) -> None:
        self.done: dict[int, Any] = {}

    def submit(self, fn: Callable, /, *args: Any, **kwargs: Any) -> Future:
        """Do it now, and remember."""
        future = super().submit(fn, *args, **kwargs)
        self.done[args[1].field] = future.result()
        return future


class Asleep(ThreadPoolExecutor):
    """Workers that sleep for as long as a field took, and then say what was said then: they need no core."""

    def __init__(self, workers: int, done: dict[int, Any]):
        super().__init__(workers)
        self._done = done

    def submit(self, fn: Callable, /, *args: Any, **kwargs: Any) -> Future:
        """Sleep, instead."""
        return super().submit(self._slept, args[1].field)

    def _slept(self, field: int) -> Any:
        time.sleep(self._done[field].record.times[0])
        return self._done[field]


def asleep(case: Case) -> None:
    """What order, driver and ledger leave of two workers, in wall-clock time, on a machine that is busy."""
    recorded = Recorded()
    with tempfile.TemporaryDirectory() as folder:
        fp.survey.run(*case.inputs, folder, recorded, at_once=1, **case.settings)
    wall = []
    for workers in (1, 2):
        with tempfile.TemporaryDirectory() as folder, Asleep(workers, recorded.done) as executor:
            begun = time.perf_counter()
            fp.survey.run(*case.inputs, folder, executor, at_once=workers, **case.settings)
            wall.append(time.perf_counter() - begun)
    print(f"          with workers that sleep as long: {wall[0]:.1f} and {wall[1]:.1f} s wall, {wall[0] / wall[1]:.2f}")


def _scheduled(case: Case, seconds: list[float], workers: int) -> float:
    """When so many workers are done if each field takes so long, and waits for those that it has to wait for [s]."""
    targets, fields = SurveyTargets.of(case.inputs[1]), Fields.of(case.inputs[2])
    lying, repeated = targets.lying_in(fields, case.settings["telescope"]), targets.repeated(case.settings["required"])
    order = Precedence(fields.chain, len(targets))
    for k in range(len(fields)):
        there = targets.target[lying.of(k)[0]]
        order.add(there[~repeated[there]])
    now, running = 0.0, []
    while True:
        while len(running) < workers and (k := order.next()) is not None:
            heapq.heappush(running, (now + seconds[k], k))
        if not running:
            return now
        now, k = heapq.heappop(running)
        order.done(k)


def _busy() -> float:
    """CPU seconds that all processes of this machine have had."""
    user, nice, system = (int(each) for each in Path("/proc/stat").read_text().split()[1:4])
    return (user + nice + system) / os.sysconf("SC_CLK_TCK")


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--fields", type=int, default=40)
    parser.add_argument("--rounds", type=int, default=1)
    parser.add_argument("--full", action="store_true", help="547 robots, not 61")
    parser.add_argument("--regions", type=int, nargs="+", default=[4, 1], help="of the sky that share no targets")
    parser.add_argument("--awake", action="store_true", help="without workers that sleep")
    options = parser.parse_args()
    speed_up(options.fields, options.rounds, options.full, options.regions, options.awake)


if __name__ == "__main__":
    main()
