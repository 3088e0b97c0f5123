"""What shows each pair clear, as data: for intervals that cover the motion, axes that separate the two arms.

An axis is a fixed direction in the focal plane, given by its angle. Over a row's interval it keeps apart, by the margin
and more, some of the convex pieces of the first arm and of the second; where one axis does not part all pieces that
meet, several rows have the same interval. How near the pieces come is not stored: whoever replays the proof
(`fiberplan.certificates.replay`, which shares nothing with this) finds out again.

Rows are made from the beginning to the end of a motion. The axes of one stretch are tried for the next, and taken anew,
along the shortest connections in the middle, where they no longer hold; a stretch that is not shown is halved.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fiberplan.arrays import Frozen, read_only
from fiberplan.certificates.opening import Opening
from fiberplan.certificates.path import as_motion, next_knot, rounding, state
from fiberplan.focal_plane import FocalPlane
from fiberplan.kernels.arms import frame
from fiberplan.kernels.clearance import meet
from fiberplan.kernels.compile import kernel, leaf, record
from fiberplan.kernels.depth import signed_gap
from fiberplan.kernels.even_motion import least_gap_along
from fiberplan.kernels.four_bar import largest_acceleration, rates
from fiberplan.motion import Trajectory
from fiberplan.tolerances import NEAR, OPENING, ROUNDING

ROW = record([("pair", "i8"), ("begin", "f8"), ("end", "f8"), ("axis", "f8")])
_MOST_AXES = 64  # that part all pieces of two arms in one interval; if more were needed, the interval is halved
_MOST_STEPS = 20_000  # of one pair between two knots; a pair that needs more is not shown


@dataclass(frozen=True, eq=False)
class Witnesses(Frozen):
    """Rows, sorted by pair, then by time."""

    pairs: np.ndarray  #: (r, 2) positioners; -1 - k is obstacle k
    begin: np.ndarray  #: (r,) [s]
    end: np.ndarray  #: (r,) [s]
    axis: np.ndarray  #: (r,) direction from the first to the second [rad]

    def __repr__(self) -> str:
        return f"<Witnesses: {len(self.axis)} rows>"


def witnesses(
    plane: FocalPlane,
    trajectory: Trajectory,
    margin: float,
    position_error: np.ndarray,
    opening: Sequence[Opening] = (),
) -> Witnesses:
    """What shows clear each pair of which one can move and that could come within the margin.

    Pairs that it does not hold of are left out from where it does not.

    Args:
        plane: whose bodies move, and among which obstacles.
        trajectory: of all its positioners.
        margin: clearance to show [mm].
        position_error: (n,) by which each arm may be off [mm].
        opening: pairs that begin nearer, as `verify` found them; shown to keep what they begin with until they have it.
    """
    path = as_motion(plane.arms, trajectory)
    errors = np.concatenate([position_error, np.zeros(len(plane.obstacles))])
    errors = errors + rounding(plane.arms, path.offsets, path.knots)
    pairs = plane.arm_pairs_within(margin + 2.0 * float(errors.max(initial=0.0)) + NEAR)
    moves = np.append(plane.online, np.zeros(len(plane.obstacles), bool))
    pairs = read_only(pairs[moves[pairs].any(axis=1)], np.int64)
    row = {(int(i), int(j)): k for k, (i, j) in enumerate(pairs)} if opening else {}
    wanted = np.empty((len(pairs), 3))
    wanted[:, 0] = wanted[:, 1] = margin + errors[pairs].sum(axis=1)
    wanted[:, 2] = -np.inf
    for one in opening:
        i, j = (plane.arm(public) for public in one.pair)
        k = row[i, j]
        wanted[k, 1:] = one.clearance - OPENING + errors[i] + errors[j], one.time
    rows = _separating(plane.arms, path, pairs, read_only(wanted))
    public = pairs[rows["pair"]]
    return Witnesses(
        read_only(np.where(public < plane.n, public, plane.n - 1 - public), np.int64),
        *(read_only(rows[name], float) for name in ("begin", "end", "axis")),
    )


@leaf
def _parted(arms, i, j, state_i, state_j, h, wanted, axes, used, fresh):
    """Whether the first `used` of `axes` (k, 2) part two arms by `wanted` [mm] within +-h [s] of a moment.

    Returns:
        0 if not, nor axes of that moment; -1 if they do; else how many axes of that moment do, now in `fresh`.
    """
    frame_i, frame_j = frame(arms, i, state_i[0], state_i[1]), frame(arms, j, state_j[0], state_j[1])
    rates_i = rates(arms, i, frame_i, state_i[2], state_i[3])
    rates_j = rates(arms, j, frame_j, state_j[2], state_j[3])
    bend = largest_acceleration(arms, i, frame_i, state_i[2], state_i[3], h)
    bend += largest_acceleration(arms, j, frame_j, state_j[2], state_j[3], h)
    least = wanted + 0.5 * h * h * bend + ROUNDING
    for attempt in range(2):
        known, found, all_parted = axes, used, True
        if attempt == 1:
            known, found = fresh, 0
        for p in range(arms.arm[i].first_piece, arms.arm[i].last_piece):
            for q in range(arms.arm[j].first_piece, arms.arm[j].last_piece):
                if not (meet(arms, p, q) and all_parted):
                    continue
                apart = least + arms.piece[p].radius + arms.piece[q].radius
                parted = False
                for k in range(found):
                    gap = least_gap_along(arms, frame_i, rates_i, p, frame_j, rates_j, q, known[k, 0], known[k, 1], h)
                    if gap >= apart:
                        parted = True
                        break
                if not parted and attempt == 1 and found < len(fresh):
                    _, nx, ny = signed_gap(arms, frame_i, p, frame_j, q)
                    fresh[found, 0], fresh[found, 1] = nx, ny
                    found += 1
                    parted = least_gap_along(arms, frame_i, rates_i, p, frame_j, rates_j, q, nx, ny, h) >= apart
                all_parted = parted
        if all_parted and (attempt == 1 or used > 0):
            return found if attempt == 1 else -1
    return 0


@leaf
def _write(rows, count, pair, begin, end, axes, used):
    """Rows of `used` axes put from row `count` on, as far as there is room; returns how many there are then."""
    for k in range(used):
        if count + k < len(rows):
            row = rows[count + k]
            row.pair, row.begin, row.end, row.axis = pair, begin, end, np.arctan2(axes[k, 1], axes[k, 0])
    return count + used


@leaf
def _cover(arms, path, pair, i, j, wanted, rows, count, axes, fresh):
    """Rows of one pair, put from row `count` on; returns how many there are then, more than fit if they do not.

    `wanted` holds the clearance to show, that to show until a time, and that time [mm, mm, s].
    """
    n = len(path.offsets) - 1
    begin, end = path.knots[path.offsets[i]].time, path.knots[path.offsets[i + 1] - 1].time
    if j < n:
        begin = min(begin, path.knots[path.offsets[j]].time)
        end = max(end, path.knots[path.offsets[j + 1] - 1].time)
    t, since, used, length, steps = begin, begin, 0, np.inf, 0
    while steps < _MOST_STEPS:
        edge = min(end, min(next_knot(path, i, t), next_knot(path, j, t)))
        if t < wanted[2]:
            edge = min(edge, wanted[2])
        until = edge if not (length < edge - t) else t + length
        middle = 0.5 * (t + until)
        a_i, b_i, va_i, vb_i, _ = state(path, i, middle)
        a_j, b_j, va_j, vb_j, _ = state(path, j, middle)
        asked = wanted[1] if t < wanted[2] else wanted[0]
        h = max(middle - t, until - middle)
        answer = _parted(arms, i, j, (a_i, b_i, va_i, vb_i), (a_j, b_j, va_j, vb_j), h, asked, axes, used, fresh)
        steps += 1
        if answer == 0:
            length = 0.5 * min(length, edge - t)
            if t + length <= t:
                break
            continue
        if answer > 0:
            count = _write(rows, count, pair, since, t, axes, used)
            used, since = answer, t
            for k in range(used):
                axes[k, 0], axes[k, 1] = fresh[k, 0], fresh[k, 1]
        steps = steps if until < edge else 0
        t, length = until, 2.0 * length
        if t >= end:
            break
    return _write(rows, count, pair, since, t, axes, used)


@kernel
def _separating(arms, path, pairs, wanted):
    """Rows of all pairs of arms (m, 2); `wanted` (m, 3) as in `_cover`."""
    rows = np.empty(4 * len(pairs) + 16, ROW)
    axes, fresh = np.empty((_MOST_AXES, 2)), np.empty((_MOST_AXES, 2))
    count = 0
    for k in range(len(pairs)):
        more = _cover(arms, path, k, pairs[k, 0], pairs[k, 1], wanted[k], rows, count, axes, fresh)
        if more > len(rows):
            larger = np.empty(2 * more, ROW)
            for m in range(count):
                larger[m] = rows[m]
            rows = larger
            more = _cover(arms, path, k, pairs[k, 0], pairs[k, 1], wanted[k], rows, count, axes, fresh)
        count = more
    return rows[:count].copy()
