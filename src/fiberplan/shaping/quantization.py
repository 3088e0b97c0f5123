"""Joint speeds in a few bits: Makarem2014's outlook, for thousands of motors on one bus.

Time is cut into ticks and in each of them a joint turns at one of a few speeds (`fiberplan.shaping.levels`). Each
positioner follows the given motion by feedback: it takes the levels that bring it nearest to where it should be at
the end of the tick, so its error does not add up. What it takes is tested like a planner's step, against all
neighbours over the whole tick, and where the nearest levels would come too near, others or none are taken; so the
result is as safe as a plan.
"""

from dataclasses import dataclass

import numpy as np

from fiberplan.arrays import Frozen, number, read_only
from fiberplan.errors import TrajectoryError
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.kernels.arms import motion
from fiberplan.kernels.compile import inlined, kernel, leaf
from fiberplan.motion import Trajectory
from fiberplan.planners.shared.safe_steps import refused_by, stepping, take
from fiberplan.shaping.levels import units
from fiberplan.tolerances import UNDER_LIMIT

_LONGER = 1.1  # the motion may take this much longer than the stretched one ...
_TICKS_MORE = 50  # ... and so many ticks besides
_LANDING = 1e-4  # [mm] a tick should end this much clearer than it must, or no nearer than it began


@dataclass(frozen=True, eq=False)
class Quantized(Frozen):
    """What a motion became, and how well it follows the one it was made from."""

    levels: np.ndarray  #: (ticks, n, 2) what is sent to each joint in each tick
    unit: np.ndarray  #: (n, 2) speed of level 1, sent once [rad/s]
    tick: float  #: [s]
    bits: int  #: of one level
    stretch: float  #: the motion that was followed took this many times as long as the given one
    tracking_error: np.ndarray  #: (n,) largest distance of the fiber from where it should be, at the ends of ticks [mm]
    final_error: np.ndarray  #: (n,) distance of the fiber from where the given motion ends [mm]

    @property
    def bits_per_positioner(self) -> int:
        """Bits of levels that one positioner receives for the whole motion."""
        return 2 * self.bits * len(self.levels)

    def __repr__(self) -> str:
        return f"<Quantized: {self}>"

    def __str__(self) -> str:
        return (
            f"{self.bits} bits a joint and tick, {self.bits_per_positioner} bits a positioner; "
            f"tracking error at most {self.tracking_error.max(initial=0.0) * 1e3:.0f} um, "
            f"at the end {self.final_error.max(initial=0.0) * 1e3:.1f} um"
        )


def quantize(
    trajectory: Trajectory, bits: int, *, plane: FocalPlane, margin: float = 0.0, tick: float = 0.01
) -> tuple[Trajectory, Quantized]:
    """The motion in joint speeds of `bits` bits, held for a `tick` each; source: Makarem2014, section 5 (future work).

    Args:
        trajectory: a motion that is safe at `margin`.
        bits: of one joint's speed in one tick, 2 to 8.
        plane: whose joints move.
        margin: clearance to keep [mm].
        tick: for how long a speed is held [s].

    Returns:
        the quantized motion, which begins where `trajectory` does, and a report.

    Raises:
        TrajectoryError: another number of positioners than the focal plane has, a number of bits, tick or margin that
            cannot be used.
    """
    margin = number(margin, "mm", "quantize: margin", TrajectoryError)
    tick = number(tick, "s", "quantize: tick", TrajectoryError)
    _refuse(trajectory, bits, plane, margin, tick)
    speed = plane.max_speed * UNDER_LIMIT
    turn = trajectory.end - trajectory.start
    unit, top = units(turn, speed, tick, bits)
    stretch = _stretch(trajectory, top * unit / tick)
    ticks = int(np.ceil(trajectory.duration * stretch / tick - 1e-9))
    room = int(_LONGER * ticks) + _TICKS_MORE if ticks else 0
    levels = np.zeros((room, plane.n, 2), np.int8)
    near = Neighbourhood.of(plane, margin)
    now = stepping(plane, trajectory.start, margin, near)
    lowest = np.ceil((plane.lower - trajectory.start) / unit - 1e-9)
    highest = np.floor((plane.upper - trajectory.start) / unit + 1e-9)
    goal = np.clip(np.rint(turn / unit), lowest, highest).astype(np.int64)
    place = np.zeros((plane.n, 2), np.int64)
    ranges = np.stack([lowest, highest])
    error = np.zeros(plane.n)
    used = 0
    movable = plane.online & np.any(_turns(trajectory) > 0, axis=1)
    while used < room:
        due = min((used + 1) * tick / stretch, trajectory.duration)
        aim = np.clip(np.rint((trajectory.at(due) - trajectory.start) / unit), lowest, highest).astype(np.int64)
        if used + 1 >= ticks:
            aim = goal
            if np.array_equal(place[movable], goal[movable]):
                break
        follow(plane.arms, near, now, aim, goal, place, unit, top, ranges, movable, levels[used], used)
        used += 1
        here = trajectory.start + place * unit
        away = np.hypot(*(plane.fibers(here) - plane.fibers(trajectory.at(due))).T)
        error = np.maximum(error, away)
    made = _trajectory(trajectory.start, levels[:used], unit, tick)
    final = np.hypot(*(plane.fibers(made.end) - plane.fibers(trajectory.end)).T)
    report = Quantized(
        levels=read_only(levels[:used], np.int8),
        unit=read_only(unit / tick),
        tick=tick,
        bits=bits,
        stretch=stretch,
        tracking_error=read_only(error),
        final_error=read_only(final),
    )
    return made, report


def _refuse(trajectory: Trajectory, bits: int, plane: FocalPlane, margin: float, tick: float) -> None:
    if trajectory.n != plane.n:
        raise TrajectoryError(f"quantize: the motion has {trajectory.n} positioners, the focal plane {plane.n}")
    if bits not in range(2, 9):
        raise TrajectoryError(f"quantize: bits must be a whole number from 2 to 8, got {bits}")
    if not (np.isfinite(tick) and tick > 0):
        raise TrajectoryError(f"quantize: tick must be a positive time, got {tick:g}")
    if not (np.isfinite(margin) and margin >= 0):
        raise TrajectoryError(f"quantize: margin must be a length of 0 mm or more, got {margin:g}")


def _turns(trajectory: Trajectory) -> np.ndarray:
    """(n, 2) how far each joint turns in all [rad]."""
    turn = np.abs(np.diff(trajectory.angles, axis=0))
    turn[trajectory.offsets[1:-1] - 1] = 0.0  # from one positioner to the next
    return np.add.reduceat(np.concatenate([turn, np.zeros((1, 2))]), trajectory.offsets[:-1])


def _stretch(trajectory: Trajectory, top: np.ndarray) -> float:
    """How many times as long the motion must take so that no joint exceeds its `top` speed (n, 2) [rad/s]."""
    owner = trajectory.owner
    inside = owner[1:] == owner[:-1]
    spans = np.diff(trajectory.times)[inside]
    speeds = np.abs(np.diff(trajectory.angles, axis=0)[inside]) / spans[:, None]
    return float(max(1.0, (speeds / top[owner[:-1][inside]]).max(initial=0.0)))


@inlined
def _levels(aim, place, top):
    """The level that comes nearest to where a joint should be."""
    return min(max(aim - place, -top), top)


@leaf
def _choose(arms, near, now, aim, goal, place, unit, top, ranges, i, out):
    """The levels of arm i in this tick: the nearest that are safe; put in `out`, with its motion granted."""
    me = now.pose[i]
    ka, kb = _levels(aim[0], place[0], top[0]), _levels(aim[1], place[1], top[1])
    out[0] = out[1] = 0
    for trial in range(9):
        # as wanted; one joint a little less or more; half; nothing
        a, b = ka, kb
        if trial == 1 or trial == 2:
            b = min(max(kb + (1 if trial == 1 else -1), -top[1]), top[1])
        elif trial == 3 or trial == 4:
            a = min(max(ka + (1 if trial == 3 else -1), -top[0]), top[0])
        elif trial == 5:
            a, b = ka // 2 + (ka % 2 if ka < 0 else 0), kb // 2 + (kb % 2 if kb < 0 else 0)
        elif trial == 6:
            a = 0
        elif trial == 7:
            b = 0
        elif trial == 8:
            return
        if a == 0 and b == 0:
            if trial == 0:
                return
            continue
        if not (ranges[0, 0] <= place[0] + a <= ranges[1, 0] and ranges[0, 1] <= place[1] + b <= ranges[1, 1]):
            continue
        da, db = a * unit[0], b * unit[1]
        lands = place[0] + a == goal[0] and place[1] + b == goal[1]
        bound = motion(arms, i, da, db)
        if refused_by(arms, near, now, i, da, db, bound, 0.0 if lands else _LANDING) < 0:
            me.granted_alpha, me.granted_beta, me.bound = da, db, bound
            me.travel += bound
            out[0], out[1] = a, b
            place[0] += a
            place[1] += b
            return


@kernel
def follow(arms, near, now, aim, goal, place, unit, top, ranges, movable, out, tick):
    """One tick: every positioner takes levels towards `aim` (n, 2) on its lattice; `place` and `out` are changed."""
    n = len(place)
    for k in range(n):
        i = k if tick % 2 == 0 else n - 1 - k
        if movable[i]:
            _choose(arms, near, now, aim[i], goal[i], place[i], unit[i], top[i], ranges[:, i], i, out[i])
    for i in range(n):
        if out[i, 0] != 0 or out[i, 1] != 0:
            take(now, i)


def _trajectory(start: np.ndarray, levels: np.ndarray, unit: np.ndarray, tick: float) -> Trajectory:
    """The motion of `levels` (ticks, n, 2): a knot wherever a level changes."""
    ticks, n, _ = levels.shape
    if not ticks:
        return Trajectory.at_rest(start)
    padded = np.concatenate([levels, np.zeros((1, n, 2), np.int8)])
    changes = np.any(padded[1:] != padded[:-1], axis=2)  # at the end of each tick
    places = np.cumsum(levels, axis=0, dtype=np.int64)
    at, who = np.nonzero(changes)
    owner = np.concatenate([np.arange(n), who])
    times = np.concatenate([np.zeros(n), (at + 1) * tick])
    angles = np.concatenate([start, start[who] + places[at, who] * unit[who]])
    return Trajectory.from_knots(owner, times, angles, n)
