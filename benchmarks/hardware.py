"""Exports to controllers: how many fields are certified as executed, what that costs, and what simulated robots do.

``python benchmarks/hardware.py sdss --fields 50`` plans seeded fields for the controller (`plan_for`), writes each, and
prints for how many what is read back is proven at the planned margin less 0.05 mm; how often the planner was asked, and
how many pairs were led past each other anew; CPU seconds of planning and of an export (proof included), median and
worst; and how much longer motors take than the plan without limits. ``simulate`` executes one plan many times, with
clocks and joints that are off; ``homing`` tells how many sets of robots may home one after the other. Real arrays are
read from ``--data``.
"""

import argparse
import dataclasses
import json
import statistics
import tempfile
import time
from collections.abc import Iterator
from functools import cache, partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

import fiberplan as fp
from fiberplan.certificates.touching import Touching
from fiberplan.errors import PlanError
from fiberplan.hardware import CONTROLLERS
from fiberplan.hardware.certified import ALLOWANCE
from fiberplan.hardware.desi.endings import with_room_for_the_tail
from fiberplan.hardware.planned import fitted, plan_for
from fiberplan.hardware.simulated import Faults, proof_within, simulated
from fiberplan.instruments.desi import petal
from fiberplan.motion import Executed
from fiberplan.scenes.uniform import uniform_field
from measure import timed

DATA = Path(__file__).parents[2] / "shared" / "data"
SDSS_SPEED = np.radians(11.7)  #: 2,000 rpm of the motor


class Case(NamedTuple):
    """Fields of one controller."""

    plane: fp.FocalPlane
    margin: float  # [mm]
    controller: str
    ending: str
    budget: float = 60.0  # of the planner
    goals: fp.FocalPlane | None = None  # in whose ranges goals are drawn, if these are narrower


@cache
def sdss_547(data: Path) -> Case:
    """547 arms of Sayres2021 at SDSS' speed."""
    plane = fp.FocalPlane.load("sayres2021")
    return Case(plane.replace(max_speed=np.full((plane.n, 2), SDSS_SPEED)), 1.0, "sdss", "json")


@cache
def desi_petal(data: Path) -> Case:
    """Petal 0 as it was in February 2026, at 0.8 of cruise speed."""
    plane = petal(fp.FocalPlane.load(data / "desi" / "fp-20260219.ecsv"), 0)
    return Case(plane, 0.1, "desi", "csv", 5.0, with_room_for_the_tail(plane))


@cache
def moons_case(data: Path, size: int) -> Case:
    """A case of the MOONS prototype, with the limits of the driver."""
    return Case(fp.FocalPlane.load(data / "moons" / str(size) / "positioners.cfg"), 0.1, "moons", "json")


@cache
def pfs_2394(data: Path) -> Case:
    """The built-in PFS: 2,394 cobras of nominal measures."""
    return Case(fp.FocalPlane.load("pfs"), 0.1, "pfs", "csv")


CASES = {
    "sdss": sdss_547,
    "desi": desi_petal,
    "moons-250": partial(moons_case, size=250),
    "moons-1006": partial(moons_case, size=1006),
    "pfs": pfs_2394,
}


def problems(case: Case, seeds: range) -> Iterator[fp.Problem]:
    """From field 2 k to field 2 k + 1; those that are offline stay folded."""
    plane = fitted(case.plane, case.controller)
    for seed in seeds:
        start = uniform_field(plane, 2 * seed, case.margin)
        goal = uniform_field(case.goals or plane, 2 * seed + 1, case.margin)
        here = np.where(plane.online[:, None], start, plane.folded)
        there = np.where(plane.online[:, None], goal, np.nan)
        yield fp.Problem(plane, here, there, case.margin, conflicts="drop", near_start="open")


def exports(name: str, seeds: range, data: Path) -> None:
    case, folder = CASES[name](data), Path(tempfile.mkdtemp())
    export, planning, longer, part, counts, asked, refused = [], [], [], [], [], [], []
    for seed, problem in zip(seeds, problems(case, seeds), strict=True):
        planner, path = fp.planners.Direct(seed=seed, budget=case.budget), folder / f"{seed}.{case.ending}"
        free = planner.plan(problem)
        try:
            cpu, _, plan = timed(lambda: plan_for(case.controller, planner, problem))  # noqa: B023 (called at once)
            planning.append(cpu)
            asked.append(plan.notes[-1])
            cpu, _, done = timed(lambda: CONTROLLERS[case.controller].write(plan, path))  # noqa: B023
        except PlanError as error:
            refused.append(f"seed {seed}: {error}")
            print(f"  seed {seed}: {free}; refused: {error}", flush=True)
            continue
        if seed > seeds[0]:  # the first compiles
            export.append(cpu)
        longer.append(done.executed.trajectory.duration - free.makespan - done.facts.get("delay", 0.0))
        part.append(longer[-1] / free.makespan)
        counts.append(_points(path))
        said = f"{asked[-1]}, {planning[-1]:.1f} s; {longer[-1]:.3f} s longer; exported in {cpu:.3f} s"
        print(f"  seed {seed}: {free}; {int(free.kept - plan.kept)} more lost; {said}", flush=True)
    proven = len(longer)
    print(f"{name}: {proven} of {len(seeds)} certified as executed at {case.margin:g} mm less {ALLOWANCE:g}")
    for line in refused[:3]:
        print(f"  {line[:300]}")
    if not proven:
        return
    times = [int(note.split()[1]) for note in asked]
    led = [int(note.split(", ")[1].split()[0]) if "led" in note else 0 for note in asked]
    print(f"  planned {np.mean(times):.2f} times, worst {max(times)}; led anew {np.median(led):g}, most {max(led)}")
    print(f"  planning: {statistics.median(planning):.1f} s of CPU, worst {max(planning):.1f} s")
    if export:
        print(f"  export with proof: {statistics.median(export):.3f} s of CPU, worst {max(export):.3f} s")
    print(
        f"  longer than the plan without limits: {statistics.median(longer):.3f} s, worst {max(longer):.3f} s "
        f"({100 * statistics.median(part):.1f} %, worst {100 * max(part):.1f} %)"
    )
    if counts[0]:
        print(f"  points of a robot, median of medians: {np.median(counts, axis=0).tolist()} (busier axis, both axes)")


def _points(path: Path) -> tuple[float, ...]:
    """Points of a robot's busier axis and of both, medians; nothing where there are none."""
    if path.suffix != ".json":
        return ()
    sent = json.loads(path.read_text()).get("trajectory", {})
    counts = np.array([[len(axes["alpha"]), len(axes["beta"])] for axes in sent.values()])
    return (float(np.median(counts.max(axis=1))), float(np.median(counts.sum(axis=1)))) if len(counts) else ()


RUNS = Faults(latency=0.02, drift=1e-4, tracking=np.radians(0.05), step=np.radians(0.01))  #: of `simulate`


def simulate(count: int) -> None:
    """Runs of a plan of the built-in SDSS, at 0.8 mm, with clocks and joints within what the proof has room for."""
    plane = fp.FocalPlane.load("sdss")
    start, goal = (uniform_field(plane, seed, 0.8) for seed in (0, 1))
    plan = fp.planners.Direct(budget=20.0).plan(fp.Problem(plane, start, goal, 0.8))
    proof = proof_within(plane, Executed.exactly(plan.trajectory), RUNS)
    touching = Touching(plane)
    touching.contacts(simulated(plan.trajectory, RUNS))  # compiles
    begun = time.process_time()
    touched = sum(bool(touching.contacts(simulated(plan.trajectory, RUNS, seed))) for seed in range(count))
    minutes = (time.process_time() - begun) / 60
    said = f"{plane.n} robots, {plan.makespan:.1f} s, proof with these clocks and joints: {proof}"
    print(f"simulate: {said}; {touched} of {count} runs touch; {count / minutes:,.0f} runs a minute of CPU", flush=True)
    late = dataclasses.replace(RUNS, latency=1.0, abort=0.5 * plan.makespan, any_stall=1)
    touched = sum(bool(touching.contacts(simulated(plan.trajectory, late, seed))) for seed in range(200))
    print(f"simulate: up to 1 s late, one stalls, aborted half way: {touched} of 200 runs touch")


def homing(data: Path) -> None:
    """Sets of robots that may home at the same time, from a seeded field, beside the fewest that any order needs."""
    for name in ("sdss", "desi", "moons-1006"):
        case = CASES[name](data)
        state = np.where(case.plane.online[:, None], uniform_field(case.plane, 0, case.margin), case.plane.folded)
        cpu, _, groups = timed(partial(fp.homing_groups, case.plane, state, case.margin))
        able = int(case.plane.online.sum())
        print(f"homing: {name}, {able} of {case.plane.n} online, {case.margin:g} mm: {groups}; {cpu:.1f} s", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=(*CASES, "simulate", "homing"))
    parser.add_argument("--fields", type=int, default=50, help="fields, or runs")
    parser.add_argument("--first", type=int, default=0, metavar="SEED", help="of the first field")
    parser.add_argument("--data", type=Path, default=DATA)
    given = parser.parse_args()
    if given.what == "simulate":
        simulate(given.fields)
    elif given.what == "homing":
        homing(given.data)
    else:
        exports(given.what, range(given.first, given.first + given.fields), given.data)


if __name__ == "__main__":
    main()
