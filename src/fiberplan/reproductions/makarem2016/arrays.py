"""Whole arrays under random fields: the paper's own 1025 positioners, and Sayres2021's 547."""

from collections.abc import Iterator

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.problem import Problem
from fiberplan.reproductions.makarem2016.runs import MODES, Run, planned
from fiberplan.reproductions.rows import Row, mean, value
from fiberplan.scenes.clustered import clustered_targets
from fiberplan.scenes.uniform import uniform_field

BUFFERS = (1.5, 2.0)  #: of Sayres2021 [mm]
Runs = dict[tuple[str, str], list[Run]]  #: (field or direction, mode)


def warm_up() -> None:
    """Compile the kernels, so that no time is theirs."""
    plane = FocalPlane.hexagonal(1, 22.4)
    for mode in MODES:
        planned(Problem(plane, plane.folded, uniform_field(plane, 0)), mode)


def on_its_own_array(trials: int) -> Runs:
    """From the datum to random fields, uniform and clustered, of 1025 positioners."""
    plane = FocalPlane.load("makarem2016")
    runs: Runs = {(kind, mode): [] for kind in ("uniform", "clustered") for mode in MODES}
    for seed in range(trials):
        problems = {
            "uniform": Problem(plane, plane.folded, uniform_field(plane, seed)),
            "clustered": Problem.from_targets(plane, clustered_targets(plane, seed), conflicts="drop"),
        }
        for kind, mode in runs:
            runs[kind, mode].append(planned(problems[kind], mode)[1])
    return runs


def own_rows(runs: Runs) -> Iterator[Row]:
    """Assigned, arrived, contacts and times."""
    for (kind, mode), some in runs.items():
        where = f"{kind} targets, {mode}"
        if mode == "alone":
            paper = "1025" if kind == "uniform" else "up to 1025"
            yield mean(f"assigned of 1025, {kind} targets", paper, [run.asked for run in some])
        yield mean(f"arrived of 1025, {where}", "most, not all", [run.arrived for run in some])
        yield value(f"contacts in all runs, {where}", 0.0, float(sum(run.contacts for run in some)), len(some))
        yield mean(f"motion time, {where} [s]", None, [run.motion for run in some])
        yield mean(f"time to compute, {where} [s]", None, [run.cpu for run in some])


def on_sayres2021(trials: int) -> dict[float, Runs]:
    """By buffer: from folded to uniform fields, and from those fields back to folded."""
    plane = FocalPlane.load("sayres2021")
    found: dict[float, Runs] = {}
    for buffer in BUFFERS:
        margin = 2.0 * (buffer - 1.5)
        runs: Runs = {(way, mode): [] for way in ("forward", "reverse") for mode in MODES}
        for seed in range(trials):
            field = uniform_field(plane, seed, margin)
            ends = {"forward": (plane.folded, field), "reverse": (field, plane.folded)}
            for way, mode in runs:
                runs[way, mode].append(planned(Problem(plane, *ends[way], margin), mode)[1])
        found[buffer] = runs
    return found


def sayres_rows(found: dict[float, Runs]) -> Iterator[Row]:
    """What Sayres2021 says of this method on arrays like theirs."""
    for buffer, runs in found.items():
        share = {key: np.array([run.arrived / run.asked for run in some]) for key, some in runs.items()}
        where = f"sayres2021, buffer {buffer:g} mm"
        yield mean(f"share deadlocked, alone, {where}", "0.3-0.4", 1.0 - share["forward", "alone"])
        yield mean(f"share arrived, relief, {where}", "0.8-0.95", share["forward", "relief"])
        yield mean(f"share arrived in reverse, alone, {where}", "works well", share["reverse", "alone"])
        yield mean(f"share arrived in reverse, relief, {where}", "works well", share["reverse", "relief"])
        unsafe = sum(run.contacts for some in runs.values() for run in some)
        yield value(f"contacts in all runs, {where}", None, float(unsafe), sum(len(some) for some in runs.values()))
