"""Where everyone stands before moving to targets whose source says who cannot move, or where nobody knows."""

import dataclasses

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.errors import ProblemError
from fiberplan.focal_plane import FocalPlane
from fiberplan.problem.state import State
from fiberplan.problem.targets import Targets


def starting_state(plane: FocalPlane, targets: Targets, start: np.ndarray | State | None) -> State:
    """The state to begin in: who has no position in the targets' source is offline, where the start says or folded."""
    if isinstance(start, State):
        state = start
    else:
        angles = plane.folded if start is None else read_only(start, unit="rad", name="start", error=ProblemError)
        unsaid = np.zeros(plane.n, bool)
        if angles.shape == (plane.n, 2):
            lost = [plane.names[id_] for id_ in targets.offline]
            unsaid[lost] = True if start is None else np.isnan(angles[lost]).any(axis=1)
            angles = np.where(unsaid[:, None], plane.folded, angles)
        if angles.shape != (plane.n, 2):
            raise ProblemError(f"start must have shape ({plane.n}, 2), got {angles.shape}")
        bad = np.flatnonzero(~np.isfinite(angles).all(axis=1))
        if len(bad):
            raise ProblemError(f"start: positioner '{plane.ids[bad[0]]}' has no finite angles", (int(bad[0]),))
        state = State(angles, plane.online, unknown=unsaid, source=targets.source)
    online, notes = state.online.copy(), list(state.notes)
    disabled = targets.disabled_at(plane)
    at, unknown = state.angles.copy(), state.unknown.copy()
    for i, (pose, _) in disabled.items():
        online[i] = False
        if start is None:
            at[i], unknown[i] = (plane.folded[i], True) if np.isnan(pose).any() else (pose, False)
    state = dataclasses.replace(state, angles=at, online=online, unknown=unknown)
    texts = []
    for i, (_, row) in disabled.items():
        alpha, beta = np.degrees(at[i])
        texts.append(f"{plane.ids[i]} ({row}) at alpha {alpha:.6g}, beta {beta:.6g} deg")
    if texts:
        notes.append(f"disabled in {targets.source}, so offline where they stand: {'; '.join(texts)}")
    for id_ in targets.offline:
        i = plane.names[id_]
        online[i] = False
        alpha, beta = np.degrees(state.angles[i])
        notes.append(
            f"positioner '{id_}': its position is unknown in {targets.source}, so it is taken as offline, "
            f"{'folded' if state.unknown[i] else 'where the start says'}, at alpha {alpha:.6g}, beta {beta:.6g} deg"
        )
    return dataclasses.replace(state, online=online, notes=tuple(notes))
