"""Few knots of many small steps: a knot only where the motion leaves a straight line by more than is proven harmless.

In every step each arm is known to be some room clearer of everyone than it has to be. Two arms may use half of that
each, so as long as the recorded motion stays within half the room of the stepped one, at every moment, the recorded
motion keeps the margin. Per joint that is a window for the slope of the line from the last knot through each later
sample (a swinging door); a line is ended before the first sample that its window leaves out. Lines end on samples, so
mean speeds, ranges, start and end are those of the steps.
"""

from typing import NamedTuple

import numpy as np

from fiberplan.kernels.arms import motion
from fiberplan.kernels.compile import leaf, record
from fiberplan.motion import Trajectory
from fiberplan.planners.shared.memory import refuse_large
from fiberplan.tolerances import SLACK

FIDELITY = 0.02  #: the recorded motion stays this near the stepped one, where there is room for that [mm]
_EACH = SLACK / 8.0  # [mm] and may always be this far off: less than what steps keep beyond the margin

KNOT = record([("owner", "i8"), ("step", "i8"), ("alpha", "f8"), ("beta", "f8")])
TRACK = record(
    [
        ("begin", "i8"),  # step and pose of the last knot
        ("begin_alpha", "f8"),
        ("begin_beta", "f8"),
        ("step", "i8"),  # step and pose of the last sample
        ("alpha", "f8"),
        ("beta", "f8"),
        ("allowed", "f8"),  # how far the line may be from the last sample [mm]
        ("low_alpha", "f8"),  # slopes that pass all samples since the last knot [rad per step]
        ("high_alpha", "f8"),
        ("low_beta", "f8"),
        ("high_beta", "f8"),
    ]
)


class Record(NamedTuple):
    """What has been recorded so far; mutable."""

    track: np.ndarray  # (n,) TRACK
    knots: np.ndarray  # (k,) KNOT
    used: np.ndarray  # (1,) how many of them


def new_record(angles: np.ndarray) -> Record:
    """Everyone at `angles` (n, 2) [rad] at step 0."""
    n = len(angles)
    track = np.zeros(n, TRACK)
    for name, values in (("alpha", angles[:, 0]), ("beta", angles[:, 1])):
        track[name] = track[f"begin_{name}"] = values
        track[f"low_{name}"], track[f"high_{name}"] = -np.inf, np.inf
    knots = np.empty(8 * n + 16, KNOT)
    knots["owner"][:n], knots["step"][:n] = np.arange(n), 0
    knots["alpha"][:n], knots["beta"][:n] = np.asarray(angles, float).T
    return Record(track, knots, np.array([n]))


def with_room(record: Record, least: int) -> Record:
    """The same record with room for `least` more knots.

    Raises:
        ProblemError: more knots than fit into memory.
    """
    short = int(record.used[0]) + least - len(record.knots)
    if short <= 0:
        return record
    count = len(record.knots) + max(short, len(record.knots))
    refuse_large(float(count * KNOT.itemsize), f"a motion of {len(record.track)} positioners with {count} knots")
    more = np.empty(count - len(record.knots), KNOT)
    return record._replace(knots=np.concatenate([record.knots, more]))


@leaf
def _knot(record, i):
    """A knot at the last sample, from which the next line begins."""
    track = record.track[i]
    knot = record.knots[record.used[0]]
    record.used[0] += 1
    knot.owner, knot.step, knot.alpha, knot.beta = i, track.step, track.alpha, track.beta
    track.begin, track.begin_alpha, track.begin_beta = track.step, track.alpha, track.beta
    track.low_alpha = track.low_beta = -np.inf
    track.high_alpha = track.high_beta = np.inf


@leaf
def sample(arms, record, i, step, alpha, beta, room):
    """Arm i has come to (alpha, beta) [rad] at the end of step number `step`, in which it had `room` [mm].

    At most two knots are written. Steps in which an arm stands still need not be told.
    """
    track = record.track[i]
    allowed = max(_EACH, min(0.49 * room, FIDELITY))
    if track.step < step - 1:  # it rested
        if track.step > track.begin:
            _knot(record, i)
        track.step = step - 1
        _knot(record, i)
    elif track.step > track.begin:
        passed = track.step - track.begin
        within = min(track.allowed, allowed)
        around = 0.45 * within / max(motion(arms, i, 1.0, 0.0), 1e-9)  # [rad]
        track.low_alpha = max(track.low_alpha, (track.alpha - around - track.begin_alpha) / passed)
        track.high_alpha = min(track.high_alpha, (track.alpha + around - track.begin_alpha) / passed)
        around = 0.45 * within / max(motion(arms, i, 0.0, 1.0), 1e-9)
        track.low_beta = max(track.low_beta, (track.beta - around - track.begin_beta) / passed)
        track.high_beta = min(track.high_beta, (track.beta + around - track.begin_beta) / passed)
        span = step - track.begin
        slope_alpha, slope_beta = (alpha - track.begin_alpha) / span, (beta - track.begin_beta) / span
        if not (track.low_alpha <= slope_alpha <= track.high_alpha and track.low_beta <= slope_beta <= track.high_beta):
            _knot(record, i)
    track.step, track.alpha, track.beta, track.allowed = step, alpha, beta, allowed


def recorded(record: Record, dt: float) -> Trajectory:
    """The motion so far; a step takes `dt` [s]."""
    track, knots = record.track, record.knots[: record.used[0]]
    moved = np.flatnonzero(track["step"] > track["begin"])
    owner = np.concatenate([knots["owner"], moved])
    step = np.concatenate([knots["step"], track["step"][moved]])
    last = np.stack([track["alpha"], track["beta"]], axis=1)[moved]
    angles = np.concatenate([np.stack([knots["alpha"], knots["beta"]], axis=1), last])
    return Trajectory.from_knots(owner, step * dt, angles, len(track))
