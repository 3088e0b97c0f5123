"""Motions of which no power supply has too many robots moving at once: some begin later, on the paths that they have.

First those that have time, so that the motion takes as long as before; only where that is not enough it gets longer. A
robot that begins later hurries, unless that is not wanted: a planner's robots often take the time that there is, and
the sooner one is done, the sooner the next may begin. What is made is proven anew.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fiberplan.arrays import Frozen, FrozenDict, not_negative, number, read_only
from fiberplan.certificates import Certificate, verify
from fiberplan.errors import TrajectoryError
from fiberplan.focal_plane import FocalPlane
from fiberplan.motion import Trajectory
from fiberplan.shaping.delayed_pairs import Begin, DelayedPairs, begun_later, side_by_side
from fiberplan.shaping.delays import Delays
from fiberplan.shaping.hurried import hurried
from fiberplan.shaping.supply_load import Stretches, most_at_once, numbered, stretches_of, time_window

_FINE = 0.02  # of the least time: the motion gets longer than it must by no more than such steps ...
_MOST = 1.2  # ... and never so much
_PRECISION = 1e-4  # [s] to which the least time is known
_SAME = 1e-9  # of a robot: rounding of averages


@dataclass(frozen=True, eq=False)
class Staggered(Frozen):
    """A motion in which some robots begin later, and what that does to their power supplies."""

    trajectory: Trajectory
    certificate: Certificate  #: of it, at the margin that was asked for
    delay: np.ndarray  #: (n,) by how much each begins later [s]
    hurried: np.ndarray  #: (n,) which turn as fast as their joints can
    before: Mapping[str, float]  #: by supply, the largest share of its moving robots that moves at once, as it was
    after: Mapping[str, float]  #: as it is
    allowed: Mapping[str, float]  #: as it may be: the share that was asked for, but one robot may always move
    longer: float  #: than the given motion [s]
    at_least: float  #: whatever begins when, even if nobody were in the way of anybody [s]

    @property
    def over(self) -> tuple[str, ...]:
        """Supplies of which more robots move at once than should."""
        return tuple(name for name, share in self.after.items() if not share <= self.allowed[name] * (1.0 + _SAME))

    @property
    def ok(self) -> bool:
        """Whether it is proven safe, and every supply has what it may have."""
        return self.certificate.ok and not self.over

    def __repr__(self) -> str:
        return f"<Staggered: {self}>"

    def __str__(self) -> str:
        later = int(np.count_nonzero(self.delay))
        said = ", ".join(
            f"{name} {self.before[name]:.3f} before, {self.after[name]:.3f} after"
            + (f", {self.allowed[name]:.3f} asked for" if name in self.over else "")
            for name in self.after
        )
        return (
            f"{later} of {len(self.delay)} begin later, {self.longer:.3f} s longer (at least {self.at_least:.3f} s); "
            f"share that moves at once: {said}; {self.certificate}"
        )


def staggered(
    trajectory: Trajectory,
    plane: FocalPlane,
    supplies: Sequence[str],
    share: float = 0.5,
    window: float = 0.0,
    margin: float = 0.0,
    position_error: float | np.ndarray = 0.0,
    opening: bool = False,
    hurry: bool = True,
) -> Staggered:
    """The motion with at most a share of each supply's robots moving at once, of those that move at all.

    Paths stay as they are; some begin later, by whole milliseconds, and pairs that then would come too near begin later
    together. One robot of a supply may always move. The motion gets longer only where it has to.

    Args:
        trajectory: a motion that is safe at `margin`.
        plane: whose robots move.
        supplies: (n,) by which supply each robot is driven.
        share: of a supply's moving robots, from above 0 to 1.
        window: on average over so long [s]; 0: at any moment; inf: over the whole motion.
        margin: clearance to keep [mm].
        position_error: as `verify` takes it [mm].
        opening: as `verify` takes it.
        hurry: let those that begin later turn as fast as their joints can, without rests; never where the plane has
            accelerations or least speeds, of which that knows nothing.

    Returns:
        the motion with the least excess that was found; what could not be met is in `over`.

    Raises:
        TrajectoryError: another number of positioners or supplies than the focal plane has, a share or window that
            makes no sense, or what `verify` refuses.
    """
    if trajectory.n != plane.n:
        raise TrajectoryError(f"staggered: the motion has {trajectory.n} positioners, the focal plane {plane.n}")
    share = number(share, "", "share", TrajectoryError)
    if not 0.0 < share <= 1.0:
        raise TrajectoryError(f"share must be above 0 and at most 1, got {share:g}")
    window, margin = time_window(window), not_negative(margin, "mm", "margin", TrajectoryError)
    error = read_only(position_error, unit="mm", name="position error", error=TrajectoryError)
    if error.shape not in ((), (plane.n,)) or not (np.isfinite(error) & (error >= 0.0)).all():
        raise TrajectoryError(f"position error must be one length of 0 mm or more, or {plane.n}")
    names, supply = numbered(supplies, plane.n)
    moves = stretches_of(trajectory)
    count = np.bincount(supply[np.unique(moves.owner)], minlength=len(names))
    limits = np.maximum(1.0, share * count + _SAME)
    if window == 0.0:
        limits = np.floor(limits)
    motions = [trajectory]
    if hurry and plane.max_acceleration is None and plane.min_speed is None:
        motions.append(hurried(trajectory, plane))
    shortest = stretches_of(motions[-1])
    least = trajectory.duration
    for k, limit in enumerate(limits):
        least = max(least, _shortest(shortest.of(supply == k), limit, window))
        if window == 0.0 and len(motions) == 1:
            least = _with_room(moves.of(supply == k), limit, least)

    def loads(made: Trajectory) -> np.ndarray:
        parts = stretches_of(made)
        return np.array([most_at_once(parts.of(supply == k), made.duration, window) for k in range(len(names))])

    before = loads(trajectory)
    made, after, begins = trajectory, before, [Begin(0, 0)] * plane.n
    if (before > limits + _SAME).any():
        pairs = DelayedPairs(
            plane, motions, np.isin(np.arange(plane.n), moves.owner), margin, np.broadcast_to(error, (plane.n,))
        )
        whole = window >= least  # then only the motion's length counts; it is spread evenly all the same
        aim = np.maximum(1.0, np.floor(limits)) if whole else limits
        every = side_by_side(motions)
        search = Delays(stretches_of(every), supply, aim, 0.0 if whole else window, pairs, least)

        def within(horizon: float) -> bool:
            """Whether the limits are met in so long [s]; the better motion is kept."""
            nonlocal made, after, begins
            found = search.within(horizon)
            moved = _begun(every, trajectory, found)
            now = loads(moved)
            if max(1.0, np.max(now / limits)) <= max(1.0, np.max(after / limits)):
                made, after, begins = moved, now, found
            return bool((now <= limits + _SAME).all())

        _shorten(within, least + _PRECISION)
    movers = np.maximum(1, count)
    was, is_, may_be = (
        FrozenDict(zip(names, shares.tolist(), strict=True))
        for shares in (before / movers, after / movers, np.maximum(share, 1.0 / movers))
    )
    return Staggered(
        trajectory=made,
        certificate=verify(plane, made, margin, position_error=position_error, opening=opening),
        delay=read_only([begin.later / 1000 for begin in begins]),
        hurried=read_only([begin.path == 1 for begin in begins], bool),
        before=was,
        after=is_,
        allowed=may_be,
        longer=made.duration - trajectory.duration,
        at_least=float(least - trajectory.duration),
    )


def _shorten(within: Callable[[float], bool], least: float) -> None:
    """Find the shortest time [s] in which something can be done, to `_FINE` of the `least` one."""
    failed = enough = 0.0
    while not within(least * (1.0 + enough)):
        if enough >= _MOST:
            return
        failed, enough = enough, 2.0 * (enough + _FINE)
    while enough - failed > 1.5 * _FINE:
        middle = 0.5 * (failed + enough)
        if within(least * (1.0 + middle)):
            enough = middle
        else:
            failed = middle


def _begun(every: Trajectory, given: Trajectory, begins: Sequence[Begin]) -> Trajectory:
    """The motion in which each robot moves as it begins."""
    n = given.n
    motion = every.select(np.arange(n) + n * np.array([begin.path for begin in begins]))
    return begun_later(motion, np.array([begin.later / 1000 for begin in begins]))


def _shortest(moves: Stretches, limit: float, window: float) -> float:
    """No motion in which so many robots move at once, at most, is shorter [s].

    Windows side by side hold `limit` robots each; only in what is left over beside them may all move.
    """
    total = moves.total()
    if not 0.0 < window < total / limit:
        return total / limit
    whole = np.floor(total / (limit * window))
    return float(whole * window + (total - whole * limit * window) / len(np.unique(moves.owner)))


def _with_room(moves: Stretches, limit: float, least: float) -> float:
    """No motion is shorter, in which at most `limit` robots move at any moment: `least` [s], or more.

    In the time that there is a robot cannot but move between its latest begin and its earliest end, if these overlap.
    """
    if not len(moves.owner):
        return least
    last = np.zeros(moves.owner.max() + 1)
    last[moves.owner] = moves.end

    def fits(horizon: float) -> bool:
        begin = moves.begin + (horizon - last[moves.owner])
        must = begin < moves.end
        forced = Stretches(moves.owner[must], begin[must], moves.end[must])
        return most_at_once(forced, horizon, 0.0) <= limit

    if fits(least):
        return least
    short, long = least, 2.0 * float(last.max())  # in which nobody has to
    while long - short > _PRECISION:
        middle = 0.5 * (short + long)
        short, long = (short, middle) if fits(middle) else (middle, long)
    return short
