"""Targets that no positioner of a focal plane can have: named and left out, where the rest shall be planned."""

import dataclasses
from typing import Any

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.problem.targets import Targets
from fiberplan.tables.wording import nearest

_WHO = ("positioner", "second_names", "rows", "assigned", "disabled")
_OF_ROWS = (*_WHO, "x", "y", "priority", "fiber", "parity", "angles", "base")


def of_known_positioners(targets: Targets, plane: FocalPlane) -> Targets:
    """The targets of positioners and fibers that `plane` has, of each its first; all others are lost (`left_out`).

    All of them as they are if none is left: they are of another array, which `Targets.indices` says.
    """
    if targets.positioner is None:
        return targets
    lost: dict[int, str] = {}
    fibers = {name.lower() for name in ("", *plane.fiber_offsets)}
    first: dict[int, int] = {}
    for row, id_ in enumerate(targets.positioner):
        if id_ not in plane.names:
            lost[row] = f"{plane.name} has no positioner '{id_}'{nearest(id_, plane.names)}"
        elif targets.fiber is not None and targets.fiber[row].lower() not in fibers:
            had = ", ".join(plane.fiber_offsets)
            lost[row] = f"{plane.name} has no fiber '{targets.fiber[row]}'; it has {had}"
        elif (before := first.setdefault(plane.names[id_], row)) != row:
            lost[row] = f"positioner '{plane.ids[plane.names[id_]]}' already has a target in {targets.rows[before]}"
    strangers = [id_ for id_ in targets.offline if id_ not in plane.names]
    if not (lost or strangers) or len(lost) == len(targets):
        return targets
    where = f"of {targets.source} was left out"
    said = [f"{targets.rows[row]} {where}: {why}; its target is lost" for row, why in lost.items()]
    notes = [f"{plane.name} has no positioner '{id_}', which is offline in {targets.source}" for id_ in strangers]
    kept = np.array([row not in lost for row in range(len(targets))], bool)
    return dataclasses.replace(
        targets,
        **{name: _kept(getattr(targets, name), kept) for name in _OF_ROWS},
        offline=tuple(id_ for id_ in targets.offline if id_ in plane.names),
        left_out=(*targets.left_out, *said),
        notes=(*targets.notes, *said, *notes),
    )


def _kept(values: Any, kept: np.ndarray) -> Any:
    if values is None or isinstance(values, np.ndarray):
        return None if values is None else values[kept]
    return tuple(value for value, keep in zip(values, kept, strict=True) if keep)
