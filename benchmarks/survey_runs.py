"""Surveys at scale: what the ledger costs, kills at random, many fields for real.

Parts, of which --only takes some:

- overhead: CPU of `run` in this process over that of its fields alone, 7 and 127 robots (and sdss, with --full)
- kills: a survey of small fields, killed so many times at random moments, each time with all its processes; same bytes?
- many: so many small fields for real, one process: seconds of CPU and bytes a field, memory; goes on in --folder
- pfs: the public PFS list of preliminary targets, in ../shared/data/pfs, over a few fields

Usage: python benchmarks/survey_runs.py [--only PART ...] [--fields N] [--kills N] [--many N] [--folder DIR] [--full]
"""

import argparse
import json
import random
import resource
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import nullcontext
from hashlib import sha256
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from astropy.table import Table

import fiberplan as fp
from fiberplan.scenes import clustered_sky
from fiberplan.survey import Telescope
from scenes.scene import margin_of
from scenes.uniform import sayres

PFS = Path(__file__).parents[2] / "shared" / "data" / "pfs" / "pfs_preliminary_target_archaeology.dat.gz"
_CHILD = "--child"


class Case(NamedTuple):
    """A survey to run."""

    inputs: tuple[Any, ...]  #: focal plane, catalogue, fields
    settings: dict[str, Any]


def small_survey(fields: int, rings: int = 1, per_robot: float = 3.0, regions: int = 1) -> Case:
    """Fields of a made-up sky for a hexagon of so many rings, with so many targets a robot, in chains of ten."""
    return _survey(fp.FocalPlane.hexagonal(rings, 22.4), fields, per_robot, regions, 0.5)


def sayres_survey(fields: int, regions: int = 1) -> Case:
    """Fields of a made-up sky for the 547 robots of Sayres2021 at a buffer of 2.0 mm, 3,000 targets in each."""
    return _survey(sayres(), fields, 3000.0 / 547, regions, margin_of(2.0))


def _survey(plane: fp.FocalPlane, fields: int, per_robot: float, regions: int, margin: float) -> Case:
    edge = float(np.hypot(*plane.base.T).max()) + 22.4
    telescope = Telescope("toy", [edge / 0.02], 0.02)
    sky = clustered_sky(fields, telescope.radius, per_robot * plane.n, seed=1, regions=regions)
    settings = {"margin": margin, "telescope": telescope, "required": {"sky": 1}, "solver": "heuristic"}
    return Case((plane, *sky), settings)


def sdss_survey(fields: int) -> Case:
    """Fields of a made-up sky for the SDSS-V array."""
    plane = fp.FocalPlane.load("sdss")
    sky = clustered_sky(fields, Telescope.load("sdss").radius, 3000.0, seed=1)
    return Case(
        (plane, *sky),
        {"margin": plane.recommended_margin, "required": {"sky": 60}, "regions": 4, "solver": "heuristic"},
    )


def contents(folder: Path) -> dict[str, Any]:
    """A digest of each file, and of the ledger what no clock says, in the order of fields."""
    files: dict[str, Any] = {
        str(path.relative_to(folder)): sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.stem not in ("ledger", "times")
    }
    lines = [json.loads(line.split(" ", 1)[1]) for line in (folder / "ledger.jsonl").read_text().splitlines()]
    files["ledger"] = [lines[0], *sorted((line | {"times": 0} for line in lines[1:]), key=lambda line: line["field"])]
    return files


def overhead(full: bool) -> None:
    cases = {"7 robots": small_survey(30, 1, 8.0), "127 robots": small_survey(6, 6, 8.0)}
    if full:
        cases["sdss"] = sdss_survey(3)
    print("overhead: array       fields  CPU of fields [s]  CPU of run [s]  ledger and driver  tables and report [s]")
    for name, case in cases.items():
        with tempfile.TemporaryDirectory() as folder:
            fp.survey.run(*case.inputs, Path(folder) / "first", at_once=1, **case.settings)  # kernels, imports
            begun = time.process_time()
            done = fp.survey.run(*case.inputs, Path(folder) / "timed", at_once=1, **case.settings)
            whole = time.process_time() - begun
            rerun = []
            for _ in range(3):
                begun = time.process_time()
                fp.survey.run(*case.inputs, Path(folder) / "timed", at_once=1, **case.settings)
                rerun.append(time.process_time() - begun)
        again = min(rerun)  # reads the ledger, and writes tables and report
        inside = sum(record.times[0] for record in done.records)
        more = (whole - inside - again) / inside
        print(f"          {name:<12}{len(done.records):>6}{inside:>17.2f}{whole:>16.2f}{more:>18.1%}{again:>20.2f}")


def cpu_seconds() -> float:
    """Of this process and of those that it started and that have ended."""
    both = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(use.ru_utime + use.ru_stime for use in both)


def kills(fields: int, count: int, seed: int = 0) -> None:
    rng = random.Random(seed)
    case = small_survey(fields)
    with tempfile.TemporaryDirectory() as folder:
        whole, ended = Path(folder) / "whole", Path(folder) / "ended"
        begun = time.perf_counter()
        fp.survey.run(*case.inputs, whole, at_once=1, **case.settings)
        seconds = time.perf_counter() - begun
        progress: list[int] = []
        for _ in range(count):
            child = _started(fields, ended)
            lines = _lines(ended)
            wanted, deadline = lines + rng.randint(1, max(1, fields // (count + 2))), time.monotonic() + 300
            while child.poll() is None and _lines(ended) < wanted and time.monotonic() < deadline:
                time.sleep(0.01)
            time.sleep(rng.random() * seconds / fields)  # anywhere within a field
            child.send_signal(signal.SIGKILL)
            child.wait()
            progress.append(_lines(ended))
        code = _started(fields, ended).wait()
        same = contents(whole) == contents(ended)
        print(f"kills: {count} of a survey of {fields} fields, at lines {progress}; last exit code {code}")
        print(f"       {'same bytes as undisturbed' if same else 'FILES DIFFER'}, recorded times aside")


def _started(fields: int, folder: Path) -> subprocess.Popen:
    return subprocess.Popen([sys.executable, __file__, _CHILD, str(fields), str(folder)], stdout=subprocess.DEVNULL)


def _lines(folder: Path) -> int:
    ledger = folder / "ledger.jsonl"
    return ledger.read_bytes().count(b"\n") if ledger.exists() else 0


def many(fields: int, kept: Path | None) -> None:
    """So many small fields; in a folder that is kept it goes on where an earlier run was ended."""
    case = small_survey(fields)
    with tempfile.TemporaryDirectory() if kept is None else nullcontext(kept) as folder:
        before, begun = cpu_seconds(), time.perf_counter()
        done = fp.survey.run(*case.inputs, folder, at_once=1, report=_said, **case.settings)
        cpu, wall = cpu_seconds() - before, time.perf_counter() - begun
        size = sum(path.stat().st_size for path in Path(folder).rglob("*") if path.is_file())
        ledger = (Path(folder) / "ledger.jsonl").stat().st_size
        before = cpu_seconds()
        fp.survey.run(*case.inputs, folder, at_once=1, **case.settings)
        again = cpu_seconds() - before
    inside, memory = sum(record.times[0] for record in done.records), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    each = inside / fields
    print(f"many: {done}")
    print(f"      {fields} fields of 7 robots: {cpu:.0f} s CPU, {wall:.0f} s wall; a field alone {each:.3f} s CPU")
    print(f"      {size / fields / 1e3:.1f} kB a field, ledger {ledger / fields / 1e3:.2f} kB; {memory / 1024:.0f} MiB")
    print(f"      started again when done: {again:.1f} s CPU")


def _said(how_far: str) -> None:
    if how_far.split()[0].endswith("00"):
        print(f"      {how_far}", flush=True)


def pfs(fields: int) -> None:
    if not PFS.exists():
        print(f"pfs: {PFS} is not here")
        return
    listed = Table.read(
        PFS, format="ascii.no_header", names=("id", "ra", "dec", "exposure", "rank", "mag", "z", "type")
    )
    catalogue = Table({"id": listed["id"], "ra": listed["ra"], "dec": listed["dec"]})
    catalogue["category"] = [f"archaeology-{rank}" for rank in listed["rank"]]
    catalogue["tier"] = listed["rank"]
    catalogue["visits"] = np.maximum(1, np.round(listed["exposure"] / 900.0)).astype(int)  # of 15 minutes
    where = Table({"id": [f"visit-{k}" for k in range(fields)]})
    where["ra"], where["dec"] = np.mean(catalogue["ra"]), np.mean(catalogue["dec"])
    for table in (catalogue, where):
        for name in ("ra", "dec"):
            table[name].unit = "deg"
    plane = fp.FocalPlane.load("pfs")
    with tempfile.TemporaryDirectory() as folder:
        before = cpu_seconds()
        done = fp.survey.run(plane, catalogue, where, folder, at_once=1, solver="heuristic", margin=0.0)
        print(
            f"pfs: {len(catalogue)} targets, {fields} visits of one field, {cpu_seconds() - before:.1f} s CPU: {done}"
        )
        print(done.tables()["completeness"])
        print(done.tables()["fields"]["field", "offered", "observed", "makespan", "lower_bound", "failed"])


def main() -> None:
    if len(sys.argv) > 1 and sys.argv[1] == _CHILD:
        case = small_survey(int(sys.argv[2]))
        fp.survey.run(*case.inputs, sys.argv[3], at_once=1, **case.settings)
        return
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parts = ("overhead", "kills", "many", "pfs")
    parser.add_argument("--only", nargs="+", choices=parts, default=parts)
    parser.add_argument("--fields", type=int, default=200, help="of the kills")
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--many", type=int, default=1000)
    parser.add_argument("--folder", type=Path, help="of the many, which is kept, so that a run that was ended goes on")
    parser.add_argument("--full", action="store_true", help="overhead of the SDSS-V array, too")
    options = parser.parse_args()
    if "overhead" in options.only:
        overhead(options.full)
    if "kills" in options.only:
        kills(options.fields, options.kills)
    if "many" in options.only:
        many(options.many, options.folder)
    if "pfs" in options.only:
        pfs(3)


if __name__ == "__main__":
    main()
