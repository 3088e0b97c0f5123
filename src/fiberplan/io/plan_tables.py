"""Plans as tables, and tables as plans: which column holds what.

Angles are in radians, lengths in mm, times in s. Goals are stored as they were settled, with what was requested beside
them, so that a plan reads back without deciding anything again.
"""

import dataclasses
import json
from collections.abc import Mapping
from typing import Any

import numpy as np
from astropy.io import fits

from fiberplan.certificates.witnesses import witnesses
from fiberplan.errors import PlanError
from fiberplan.io.certificate_tables import barrier_tables
from fiberplan.io.focal_plane_tables import plane_from_tables, plane_hdus
from fiberplan.io.proof_tables import proof_table, tuples
from fiberplan.motion import Trajectory
from fiberplan.plan import Bound, Outcome, Plan
from fiberplan.problem import Dropped, Problem, State
from fiberplan.tables.fits_tables import numbers, pick, table_hdu, texts

_ANGLES = ("start", "goal", "requested")
_SAID = {"planner": str, "parameters": dict, "seed": int, "timings": dict, "notes": list, "problem": dict}


def plan_hdus(plan: Plan, certificate: bool = True) -> list[fits.BinTableHDU]:
    """The tables of the focal plane, POSITIONERS with outcomes, then KNOTS, PROBLEM, CERTIFICATE, PARAMETERS.

    With `certificate`, CERTIFICATE_AXES too, and CERTIFICATE_BARRIERS and CERTIFICATE_TREES where losses are proven:
    what shows each pair clear, and what cannot be left, for `fiberplan replay`.
    """
    about, positioners, *others = plane_hdus(plan.problem.plane)
    outcomes = table_hdu("", {"outcome": [outcome.name for outcome in plan.outcomes]})
    return [
        about,
        fits.BinTableHDU.from_columns(positioners.columns + outcomes.columns, name="POSITIONERS"),
        *others,
        _knots(plan.trajectory),
        _problem_table(plan),
        proof_table(plan.certificate),
        *([_axes_table(plan), *barrier_tables(plan)] if certificate else []),
        table_hdu("PARAMETERS", {"json": [json.dumps(_parameters(plan), default=_plain)]}),
    ]


def plan_from_tables(tables: Mapping[str, Any]) -> Plan:
    """The plan in these tables."""
    said = json.loads(texts(pick(tables, "PARAMETERS", PlanError), "json")[0])
    table, knots = pick(tables, "PROBLEM", PlanError), pick(tables, "KNOTS", PlanError)
    plane = plane_from_tables(tables)
    _compare(pick(tables, "POSITIONERS", PlanError), table)
    for key, kind in _SAID.items():
        if not isinstance(said[key], kind):
            raise PlanError(f"PARAMETERS: {key} is {said[key]!r}")

    def angles(name: str) -> np.ndarray:
        return np.stack([numbers(table, f"{name}_{joint}") for joint in ("alpha", "beta")], axis=-1)

    k = said["problem"]["alternatives"]
    alternatives = (
        None if k is None else angles("alternatives").reshape(plane.n, k, 2) if k else np.empty((plane.n, 0, 2))
    )
    cause, why = texts(table, "cause"), texts(table, "dropped_for")
    dropped = {
        int(i): Dropped(cause[i], tuple(json.loads(why[i]))) for i in np.flatnonzero(numbers(table, "dropped", bool))
    }
    problem = Problem.as_settled(
        plane,
        start=angles("start"),
        goal=angles("goal"),
        requested=angles("requested"),
        conflicts=said["problem"]["conflicts"],
        margin=said["problem"]["margin"],
        priority=numbers(table, "priority"),
        alternatives=alternatives,
        dropped=dropped,
        notes=tuple(said["problem"]["notes"]),
        **_circumstances(table, said["problem"], angles("start")),
        wished=numbers(table, "wished", bool) if "wished" in table.columns.names else None,
        left_out=tuple(said["problem"].get("left_out", ())),
        source=said["problem"].get("targets", ""),
    )
    owner = numbers(knots, "positioner", int)
    for k in np.flatnonzero((owner < 0) | (owner >= plane.n) | (np.diff(owner, prepend=owner[:1]) < 0))[:1]:
        raise PlanError(f"KNOTS: row {k + 1}: positioner {owner[k]} is not there, or not in its place")
    trajectory = Trajectory(
        np.searchsorted(owner, np.arange(plane.n + 1)),
        numbers(knots, "time"),
        np.stack([numbers(knots, "alpha"), numbers(knots, "beta")], axis=1),
    )
    blockers = ((i, json.loads(text)) for i, text in enumerate(texts(table, "blockers")))
    return Plan(
        problem=problem,
        trajectory=trajectory,
        outcomes=tuple(Outcome[name] for name in texts(table, "outcome")),
        planner=said["planner"],
        parameters=tuples(said["parameters"]),
        seed=said["seed"],
        blockers={i: tuple(others) for i, others in blockers if others is not None},
        timings=said["timings"],
        notes=tuple(said["notes"]),
        bounds=tuple(map(_bound, said.get("bounds", ()))),
        interrupted=bool(said.get("interrupted", False)),
    )


def _circumstances(table: Any, said: Mapping[str, Any], start: np.ndarray) -> dict[str, Any]:
    """What is known of the start, and what is done about it; files of earlier versions say nothing of it."""
    if "near_start" not in said:
        return {}
    error, source = numbers(table, "position_error"), said["source"]
    found = {
        "position_error": error,
        "near_start": said["near_start"],
        "assumptions": tuple(said["assumptions"]),
        "state": None,
    }
    if source is not None:
        online, unknown = (numbers(table, name, bool) for name in ("start_online", "start_unknown"))
        found["state"] = State(start, online, error, unknown, source, tuple(said["state_notes"]))
    return found


def _compare(positioners: Any, problem: Any) -> None:
    """Refuse POSITIONERS and PROBLEM that speak of other positioners, or of other outcomes."""
    ids, outcomes = texts(positioners, "positioner"), texts(positioners, "outcome")
    for k, (id_, outcome) in enumerate(zip(texts(problem, "positioner"), texts(problem, "outcome"), strict=True)):
        if id_ != ids[k]:
            raise PlanError(f"row {k + 1}: positioner '{id_}' in PROBLEM, but '{ids[k]}' in POSITIONERS")
        if outcome not in Outcome.__members__:
            raise PlanError(f"PROBLEM: positioner '{id_}': there is no outcome '{outcome}'")
        if outcome != outcomes[k]:
            raise PlanError(f"positioner '{id_}': outcome {outcome} in PROBLEM, but {outcomes[k]} in POSITIONERS")


def _parameters(plan: Plan) -> dict[str, Any]:
    """What is no table: settings, notes, scalars."""
    problem, proof = plan.problem, plan.certificate
    alternatives = None if problem.alternatives is None else int(np.shape(problem.alternatives)[1])
    return {
        "planner": plan.planner,
        "parameters": dict(plan.parameters),
        "seed": plan.seed,
        "timings": dict(plan.timings),
        "notes": plan.notes,
        "bounds": [dataclasses.asdict(bound) for bound in plan.bounds],
        "interrupted": plan.interrupted,
        "problem": {
            "margin": float(problem.margin),
            "conflicts": problem.conflicts,
            "notes": problem.notes,
            "left_out": problem.left_out,
            "targets": problem.source,
            "alternatives": alternatives,
            "near_start": problem.near_start,
            "assumptions": problem.assumptions,
            "source": None if problem.state is None else problem.state.source,
            "state_notes": () if problem.state is None else problem.state.notes,
        },
        "certificate": {
            "margin": proof.margin,
            "jitter": proof.jitter,
            "position_error": proof.position_error,
            "assumptions": proof.assumptions,
            "geometry": None if proof.geometry is None else dataclasses.asdict(proof.geometry),
        },
    }


def _bound(said: dict[str, Any]) -> Bound:
    """A bound as it was stored; what is an obstacle bound now was once said to have the cause "fixed"."""
    kind = said["kind"] if "kind" in said else said["cause"].replace("fixed", "obstacle")
    return Bound(kind, said["seconds"], tuple(said["positioners"]), said["proven"])


def _plain(value: Any) -> Any:
    """Scalars and arrays of numpy as JSON knows them."""
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} cannot be stored in a plan's parameters")


def _knots(trajectory: Trajectory) -> fits.BinTableHDU:
    columns = {"positioner": trajectory.owner, "time": trajectory.times}
    columns |= {"alpha": trajectory.angles[:, 0], "beta": trajectory.angles[:, 1]}
    return table_hdu("KNOTS", columns, {"time": "s", "alpha": "rad", "beta": "rad"})


def _problem_table(plan: Plan) -> fits.BinTableHDU:
    problem, n = plan.problem, plan.problem.n
    columns: dict[str, Any] = {"positioner": problem.plane.ids}
    units = {}
    angles = {name: np.asarray(getattr(problem, name)) for name in _ANGLES}
    if problem.alternatives is not None and np.shape(problem.alternatives)[1]:
        angles["alternatives"] = np.asarray(problem.alternatives, float)
    for name, values in angles.items():
        for k, joint in enumerate(("alpha", "beta")):
            columns[f"{name}_{joint}"], units[f"{name}_{joint}"] = values[..., k], "rad"
    dropped = [problem.dropped.get(i) for i in range(n)]
    columns |= {
        "priority": problem.priority,
        "outcome": [outcome.name for outcome in plan.outcomes],
        "blockers": [json.dumps(plan.blockers.get(i), default=_plain) for i in range(n)],
        "dropped": np.array([d is not None for d in dropped], bool),
        "cause": [d.cause if d else "" for d in dropped],
        "dropped_for": [json.dumps(d.blockers if d else (), default=_plain) for d in dropped],
    }
    columns["position_error"], units["position_error"] = np.asarray(problem.position_error), "mm"
    if problem.state is not None:
        columns |= {"start_online": problem.state.online, "start_unknown": problem.state.unknown}
    assert problem.wished is not None  # set on construction
    if problem.wished.any():
        columns["wished"] = problem.wished
    return table_hdu("PROBLEM", columns, units)


def _axes_table(plan: Plan) -> fits.BinTableHDU:
    problem, proof = plan.problem, plan.certificate
    assert problem.position_error is not None  # set on construction
    rows = witnesses(problem.plane, plan.trajectory, problem.margin, problem.position_error, proof.opening)
    columns = {"first": rows.pairs[:, 0], "second": rows.pairs[:, 1]}
    columns |= {"begin": rows.begin, "end": rows.end, "axis": rows.axis}
    return table_hdu("CERTIFICATE_AXES", columns, {"begin": "s", "end": "s", "axis": "rad"})
