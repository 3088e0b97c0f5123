"""What if one positioner stops dead while the rest go on: how soon is the first contact? Proven from below.

Arm i stops at t0, and arm j is where it should be at t0 + s. Over all moments t0, the least s at which the two touch
(at margin 0, less both position errors) is how soon somebody has to react. Boxes of (t0, s) are halved, always that of
the least s first: within one, neither arm gets farther than its motion bound says, so that a box whose middle is clear
by more holds no contact. What cannot be decided counts as contact. Of a motion that is safe, moments t0 at which i
rests need no look: until it goes on it is where it should be.

The same number says how far clocks may be off. If each may be off by tau, arm i is where it should be at some moment
while arm j is where it should be at most 2 tau later, or earlier; and every pair of moments that near can occur. So a
motion keeps clear for all such clocks while 2 tau is less than the least s of any pair.

Where everyone stops at once, nobody is anywhere but where it was: that is safe at any moment at which the motion is.
"""

from dataclasses import dataclass

import numpy as np

from fiberplan.arrays import Frozen, read_only
from fiberplan.certificates.clocks import travel
from fiberplan.certificates.path import as_motion, rounding, state
from fiberplan.errors import TrajectoryError
from fiberplan.focal_plane import FocalPlane
from fiberplan.kernels.arms import frame
from fiberplan.kernels.clearance import frames_clearance
from fiberplan.kernels.compile import kernel, leaf, record
from fiberplan.motion import Trajectory
from fiberplan.tolerances import NEAR, ROUNDING

RESOLUTION = 2e-4  #: reaction times are proven to within this [s], unless contact and clearance differ by less than ...
FLOOR = 1e-3  #: ... what an arm moves in a box that is not split any more [mm]
EVERYONE = 1e6  #: [mm] everything is within this of everything, even of an arm whose speed has no bound
_FIRST, _LONGER = 0.1, 4.0  # the first contact is looked for this soon [s], then so many times later
_DEPTH = 10_000  # boxes that wait
_MOST = 200_000  # looks at one positioner
BOX = record([("begin", "f8"), ("end", "f8"), ("soon", "f8"), ("late", "f8"), ("other", "i8")])  # of t0, of s [s]


@dataclass(frozen=True)
class Stall:
    """One that stops dead at the worst moment."""

    seconds: float  #: proven lower bound of the time to the first contact [s]; inf: there is none
    moment: float  #: at which it stops [s]; NaN: no contact
    positioner: int  #: that stops; -1: no contact
    other: int  #: that touches it; -1: no contact


@dataclass(frozen=True, eq=False)
class Stalls(Frozen):
    """Of each positioner, how soon another touches it if it stops dead at the worst moment."""

    seconds: np.ndarray  #: (n,) proven lower bound [s]; inf: not within the time that was asked about
    moment: np.ndarray  #: (n,) at which it stops then [s]; NaN: none
    other: np.ndarray  #: (n,) who touches it first; -1: nobody

    def __getitem__(self, i: int) -> Stall:
        return Stall(float(self.seconds[i]), float(self.moment[i]), i, int(self.other[i]))

    @property
    def soonest(self) -> Stall:
        """That of the least time: the motion's reaction time."""
        i = int(np.argmin(self.seconds)) if len(self.seconds) else -1
        return self[i] if i >= 0 and self.seconds[i] < np.inf else Stall(np.inf, np.nan, -1, -1)


@leaf
def _put(boxes, count, soon, late, begin, end, j):
    """A box more in a heap of `count` of which the first has the least `soon`; returns how many there are then."""
    k = count
    while k > 0 and soon < boxes[(k - 1) // 2].soon:
        _write(boxes[k], boxes[(k - 1) // 2])
        k = (k - 1) // 2
    box = boxes[k]
    box.soon, box.late, box.begin, box.end, box.other = soon, late, begin, end, j
    return count + 1


@leaf
def _write(box, source):
    """Copy a box into another."""
    box.soon, box.late, box.begin, box.end, box.other = source.soon, source.late, source.begin, source.end, source.other


@leaf
def _drop_first(boxes, count):
    """A heap without its first box; returns how many are left."""
    last, k = boxes[count - 1], 0
    while 2 * k + 1 < count - 1:
        child = 2 * k + 1
        if child + 1 < count - 1 and boxes[child + 1].soon < boxes[child].soon:
            child += 1
        if not boxes[child].soon < last.soon:
            break
        _write(boxes[k], boxes[child])
        k = child
    _write(boxes[k], last)
    return count - 1


@leaf
def _touched(arms, path, i, others, errors, within, boxes):
    """How soon one of `others` touches arm i, which has stopped; `boxes` is work space.

    The box of least s is always next, so that what is found first is the soonest.

    Returns:
        (lower bound, inf if it is never touched; when it stops then; who touches it) [s, s].
    """
    count, first, last = 0, path.offsets[i], path.offsets[i + 1] - 1
    while first < last:
        until = first
        while until < last and path.knots[until + 1].travelled > path.knots[until].travelled:
            until += 1
        begin, end = path.knots[first].time, path.knots[until].time
        first = until + 1 if until == first else until
        for j in others if begin < end else others[:0]:
            gone = min(end, path.knots[path.offsets[j + 1] - 1].time)
            if begin < gone:
                count = _put(boxes, count, 0.0, min(within, path.duration - begin), begin, gone, j)
    for _ in range(_MOST):
        if count == 0:
            return np.inf, np.nan, -1
        a, b, s0, s1, j = boxes[0].begin, boxes[0].end, boxes[0].soon, boxes[0].late, boxes[0].other
        count = _drop_first(boxes, count)
        t, s = 0.5 * (a + b), 0.5 * (s0 + s1)
        a_i, b_i, _, _, _ = state(path, i, t)
        a_j, b_j, _, _, _ = state(path, j, t + s)
        gap = frames_clearance(arms, i, frame(arms, i, a_i, b_i), j, frame(arms, j, a_j, b_j)) - errors[i] - errors[j]
        own, moved = travel(path, i, a, t, b), travel(path, j, a + s0, t + s, b + s1)
        if gap - own - moved - ROUNDING > 0.0:  # never of what is not a number
            continue
        touch = not gap > 0.0
        part = (b - a) / (b - a + s1 - s0)
        in_time = own + moved * part > moved * (1.0 - part) and not touch  # which side moves the arms more
        splits = a < t < b if in_time else s0 < s < s1
        done = s1 - s0 <= RESOLUTION if touch else own + moved <= FLOOR
        if done or not splits or count + 2 > len(boxes):
            return s0, t, j
        if in_time:
            count = _put(boxes, count, s0, s1, a, t, j)
            count = _put(boxes, count, s0, s1, t, b, j)
        else:
            count = _put(boxes, count, s0, s, a, b, j)
            count = _put(boxes, count, s, s1, a, b, j)
    return (boxes[0].soon, boxes[0].begin, boxes[0].other) if count else (np.inf, np.nan, -1)


@kernel
def _all_touched(arms, path, begin, others, errors, within, soonest):
    """(n, 3) seconds, moment, other of each positioner i, by `others` from begin[i] to begin[i + 1].

    Contacts later than `within` [s] are not looked for, nor, if only the `soonest` is wanted, later than one found.
    """
    out = np.empty((len(begin) - 1, 3))
    boxes = np.empty(_DEPTH, BOX)
    for i in range(len(out)):
        found = _touched(arms, path, i, others[begin[i] : begin[i + 1]], errors, within, boxes)
        out[i, 0], out[i, 1], out[i, 2] = found
        if soonest:
            within = min(within, found[0])
    return out


def stalls(
    plane: FocalPlane,
    trajectory: Trajectory,
    position_error: float | np.ndarray = 0.0,
    within: float = np.inf,
    soonest: bool = False,
) -> Stalls:
    """Of each positioner, how soon another touches it if it stops dead at the worst moment of a safe motion.

    Args:
        plane: whose bodies move.
        trajectory: of all its positioners, proven safe.
        position_error: each arm may be off by this, shared or (n,) [mm].
        within: contacts later than this are not looked for [s].
        soonest: only the least of all is wanted: the times of others are then inf, or lower bounds of theirs.

    Raises:
        TrajectoryError: another number of positioners than the focal plane has.
    """
    if trajectory.n != plane.n:
        raise TrajectoryError(f"the motion has {trajectory.n} positioners, the focal plane {plane.n}")
    path = as_motion(plane.arms, trajectory)
    error = read_only(position_error, unit="mm", name="position error", error=TrajectoryError)
    errors = rounding(plane.arms, path.offsets, path.knots)
    errors[: plane.n] += error
    pairs = plane.arm_pairs_within(2.0 * min(float(errors.max(initial=0.0)), EVERYONE) + NEAR)
    pairs = pairs[(pairs < plane.n).all(axis=1)]
    both = np.concatenate([pairs, pairs[:, ::-1]])
    both = both[np.lexsort((both[:, 1], both[:, 0]))]
    begin = read_only(np.searchsorted(both[:, 0], np.arange(plane.n + 1)), np.int64)
    others = read_only(both[:, 1], np.int64)
    found = _all_touched(plane.arms, path, begin, others, read_only(errors), within, soonest)
    return Stalls(read_only(found[:, 0]), read_only(found[:, 1]), read_only(found[:, 2], np.int64))


def reaction(plane: FocalPlane, trajectory: Trajectory, position_error: float | np.ndarray = 0.0) -> Stall:
    """How soon the first contact can be after one positioner stops dead, whichever and whenever; as `stalls`."""
    within, end = _FIRST, float(trajectory.duration)
    while within < end:
        found = stalls(plane, trajectory, position_error, within, soonest=True).soonest
        if found.seconds < within:
            return found
        within *= _LONGER
    return stalls(plane, trajectory, position_error, soonest=True).soonest
