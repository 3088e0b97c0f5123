"""Joints out of range, too fast, too slow, too sudden, or moving though offline.

What a trajectory, which is linear between knots, says of acceleration: a ramp is given as short straight pieces, whose
speeds are the ramp's mean ones. Means over neighbouring pieces of h1 and h2 seconds differ by no more than
a (h1 + h2) / 2 if the acceleration never exceeds a, and by no more than a h / 2 from rest to a piece of h seconds; one
piece between two rests has a speed of a h / 4 at most. The true ramp leaves a straight piece by up to a h^2 / 8, and
that may be `RAMP`: so a piece counts for no longer than sqrt(8 RAMP / a), however long it is. Otherwise a joint that
turns evenly for a minute could start with a jump. Knots at which a joint's speed does not change, as those of its
positioner's other joint, are left out first. A piece without a turn is a rest, unless those before and after it turn in
opposite directions: there a ramp turns round. Speeds between zero and the least speed are passed at once: of each speed
only what exceeds the least counts as changed.
"""

from collections.abc import Iterable

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.motion import Trajectory
from fiberplan.tolerances import RAMP, RANGE, SAME_SPEED, SPEED, START_RANGE

_JOINTS = ("alpha", "beta")


def violations(plane: FocalPlane, trajectory: Trajectory, opening: bool) -> Iterable[str]:
    """What a motion does that its motors cannot or must not do; the worst of each kind per positioner and joint."""
    owner, angles, times = trajectory.owner, trajectory.angles, trajectory.times
    online = plane.online[owner]

    beyond = np.maximum(plane.lower[owner] - angles, angles - plane.upper[owner])
    if opening:
        beyond = np.where(_returning(beyond, trajectory), -np.inf, beyond)
    for i, k, joint in _worst(np.where(online[:, None], beyond, -np.inf), RANGE, owner):
        low, high = np.degrees(plane.lower[i, joint]), np.degrees(plane.upper[i, joint])
        yield (
            f"positioner '{plane.ids[i]}': {_JOINTS[joint]} {np.degrees(angles[k, joint]):.6g} deg at "
            f"{times[k]:.3f} s is outside {low:.6g} to {high:.6g} deg"
        )
    same = owner[1:] == owner[:-1]
    steps, owner = np.diff(angles, axis=0)[same], owner[:-1][same]
    times, spans, online = times[:-1][same], np.diff(times)[same], online[:-1][same]
    excess = np.abs(steps) / spans[:, None] / plane.max_speed[owner] - 1.0
    for i, k, joint in _worst(np.where(online[:, None], excess, -np.inf), SPEED, owner):
        speed, limit = np.degrees(abs(steps[k, joint]) / spans[k]), np.degrees(plane.max_speed[i, joint])
        yield (
            f"positioner '{plane.ids[i]}': {_JOINTS[joint]} moves at {speed:.9g} deg/s from "
            f"{times[k]:.3f} s, limit {limit:.9g} deg/s"
        )
    yield from _too_slow(plane, owner, times, spans, np.where(online[:, None], steps, 0.0))
    yield from _too_sudden(plane, owner, times, spans, np.where(online[:, None], steps, 0.0))
    for i, k, joint in _worst(np.where(online[:, None], -np.inf, np.abs(steps)), 0.0, owner):
        yield f"positioner '{plane.ids[i]}' is offline but its {_JOINTS[joint]} moves from {times[k]:.3f} s"


def _too_slow(
    plane: FocalPlane, owner: np.ndarray, times: np.ndarray, spans: np.ndarray, steps: np.ndarray
) -> Iterable[str]:
    """Pieces (k,) of `spans` [s] in which a joint turns, by `steps` (k, 2) [rad], slower than it can."""
    if plane.min_speed is None:
        return
    least = plane.min_speed[owner]
    speed = np.abs(steps) / spans[:, None]
    lacking = np.divide(least - speed, least, out=np.full(steps.shape, -np.inf), where=least > 0)
    for i, k, joint in _worst(np.where(np.abs(steps) > RANGE, lacking, -np.inf), SPEED, owner):
        yield (
            f"positioner '{plane.ids[i]}': {_JOINTS[joint]} moves at {np.degrees(speed[k, joint]):.9g} deg/s from "
            f"{times[k]:.3f} s, least {np.degrees(least[k, joint]):.9g} deg/s"
        )


def _too_sudden(
    plane: FocalPlane, owner: np.ndarray, times: np.ndarray, spans: np.ndarray, steps: np.ndarray
) -> Iterable[str]:
    """Knots between pieces (k,) of `spans` [s], in which joints turn by `steps` (k, 2) [rad], of too much change."""
    if plane.max_acceleration is None:
        return
    for joint in (0, 1):
        most, least = plane.max_acceleration[:, joint], plane.limit("min_speed")[:, joint]
        pieces = _even_pieces(owner, times, spans, steps[:, joint], plane.max_speed[:, joint])
        who, begin, span, speed = pieces
        change, allowed = _changes(who, span, speed, least[who], most[who])
        excess = change - allowed - SPEED * plane.max_speed[who, joint]
        for i, k, _ in _worst(excess[:, None], 0.0, who):
            yield (
                f"positioner '{plane.ids[i]}': {_JOINTS[joint]} changes its speed by {np.degrees(change[k]):.6g} deg/s "
                f"at {begin[k]:.3f} s, limit {np.degrees(allowed[k]):.6g} deg/s there "
                f"({np.degrees(most[i]):.6g} deg/s^2)"
            )


def _even_pieces(
    owner: np.ndarray, times: np.ndarray, spans: np.ndarray, steps: np.ndarray, fastest: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """One joint's pieces of even speed, with a rest after each positioner's last: owner, begin, span, speed."""
    ends = np.flatnonzero(np.append(owner[1:] != owner[:-1], True)) + 1 if len(owner) else np.empty(0, int)
    last = ends - 1
    stop = times[last] + spans[last]
    owner, times = np.insert(owner, ends, owner[last]), np.insert(times, ends, stop)
    spans, steps = np.insert(spans, ends, 0.0), np.insert(steps, ends, 0.0)
    speed = np.divide(steps, spans, out=np.zeros(len(steps)), where=spans > 0)
    speed[np.abs(steps) <= RANGE] = 0.0
    first = np.ones(len(owner), bool)
    first[1:] = (owner[1:] != owner[:-1]) | (np.abs(np.diff(speed)) > SAME_SPEED * fastest[owner[1:]])
    first[1:] |= (speed[1:] == 0) != (speed[:-1] == 0)
    starts = np.flatnonzero(first)
    span, turn = (np.add.reduceat(values, starts) if len(starts) else values for values in (spans, steps))
    even = np.divide(turn, span, out=np.zeros(len(starts)), where=(span > 0) & (speed[starts] != 0))
    return owner[starts], times[starts], span, even


def _changes(
    owner: np.ndarray, span: np.ndarray, speed: np.ndarray, least: np.ndarray, most: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Change of speed above the `least` where each piece begins, and how large it may be there [rad/s]."""
    same = np.append(False, owner[1:] == owner[:-1])
    before = np.where(same, np.roll(speed, 1), 0.0)
    after = np.where(np.append(same[1:], False), np.roll(speed, -1), 0.0)
    most = np.where((speed != 0) | (before * after < 0), most, 0.0)
    alone = (before == 0) & (after == 0)
    half = 0.5 * np.minimum(most * span * np.where(alone, 0.5, 1.0), np.sqrt(8.0 * RAMP * most))
    above, above_before = (np.sign(v) * np.maximum(np.abs(v) - least, 0.0) for v in (speed, before))
    return np.abs(above - above_before), half + np.where(same, np.roll(half, 1), 0.0)


def _returning(beyond: np.ndarray, trajectory: Trajectory) -> np.ndarray:
    """(k, 2) knots that are out of range only because the joint began so, by a little, and comes back.

    From its first knot on such a joint gets no farther out; once in range, what follows is judged as ever.
    """
    out = np.zeros(beyond.shape, bool)
    first = trajectory.offsets[:-1]
    for i, joint in np.argwhere((beyond[first] > RANGE) & (beyond[first] <= START_RANGE)):
        own = slice(int(trajectory.offsets[i]), int(trajectory.offsets[i + 1]))
        values = beyond[own, joint]
        back = int(np.argmax(np.append(values, -np.inf) <= RANGE))
        out[own, joint][:back] = np.append(True, np.diff(values) <= RANGE)[:back].cumprod().astype(bool)
    return out


def _worst(excess: np.ndarray, allowed: float, owner: np.ndarray) -> list[tuple[int, int, int]]:
    """(positioner, row, joint) of the largest excess above what is allowed, once per positioner and joint."""
    rows, joints = np.nonzero(~(excess <= allowed))
    order = np.lexsort((-excess[rows, joints], joints, owner[rows]))
    found: dict[tuple[int, int], int] = {}
    for k in order:
        found.setdefault((int(owner[rows[k]]), int(joints[k])), int(rows[k]))
    return [(i, row, joint) for (i, joint), row in found.items()]
