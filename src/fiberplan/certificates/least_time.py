"""Proof that one or two positioners need a time, past each other and what never moves, whatever everybody else does.

Their joint space is cut into cells (`fiberplan.certificates.cells`), as wide as joints turn in a step of time. Those
that a motion can be in are flooded step by step: never those in which two arms are nearer than the margin all over, nor
those that are too far from the start for the time that is over, or from the goal for the time that is left. No motion
is at the goal before the flood is. Cells that are in contact in part count as free, so a little less than the time that
is needed is proven: more with finer cells, but half as wide they take ten times longer for two arms. Overlapping
outlines count by their depth, so that those without a radius are in contact, too, at any margin.
"""

from collections.abc import Sequence

import numpy as np

from fiberplan.arrays import not_negative, number, read_only, shortened
from fiberplan.certificates.cells import BITS, Cells, first_step, shut
from fiberplan.certificates.unreachable import BELOW
from fiberplan.errors import ProblemError
from fiberplan.focal_plane import FocalPlane
from fiberplan.kernels.depth import signed_clearances

TURNS = {1: np.radians(0.5), 2: np.radians(2.0)}  #: of the fastest joint in a step, for one and for two
_FINEST = 1e-6  # [rad] no cells are finer
_MOST_WORDS = 2**24  # of cells; there are three such arrays
_MOST_WORK = 2.0**31  # words times steps: some seconds
_STACK = 128  # blocks of cells that wait to be halved


def proven_least_time(
    plane: FocalPlane,
    positioners: Sequence[int],
    start: np.ndarray,
    goal: np.ndarray,
    margin: float,
    longest: float,
    turn: float | None = None,
) -> float:
    """A time that some positioners are proven to need from start to goal, at the speeds of their joints.

    Args:
        plane: the array.
        positioners: one or two that can move; all others but those that never move are left out.
        start: (n, 2) where everyone stands [rad]; offline positioners stay there.
        goal: (n, 2) [rad]; NaN where any place will do.
        margin: clearance that a motion keeps [mm]; the proof is of motions that keep 2e-6 mm less, too.
        longest: nobody asks whether more is needed than that [s].
        turn: of the fastest joint in a step of time [rad]: `TURNS` unless given, and more where that takes more than
            some hundred MiB, or seconds.

    Returns:
        the time [s], `longest` at most; what their joints alone need, from rest to rest, if nothing more is proven, as
        for arms that are not of two links, and starts or goals that do not keep the margin.

    Raises:
        ProblemError: not one or two positioners that can move, or numbers that make no sense.
    """
    who, margin = _positioners(plane, positioners), number(margin, "mm", "margin", ProblemError)
    longest = not_negative(longest, "s", "longest", ProblemError)
    turn = None if turn is None else number(turn, "rad", "turn", ProblemError)
    if not np.isfinite(margin) or not (turn is None or _FINEST <= turn <= np.pi):
        raise ProblemError(
            f"margin must be finite, and turn from {_FINEST:g} to pi rad, got {margin:g} mm and {turn} rad"
        )
    start, goal = (_configuration(q, name, plane.n) for q, name in ((start, "start"), (goal, "goal")))
    needed = float(plane.least_time(np.nan_to_num(np.abs(goal[who] - start[who])), np.array(who)).max())
    for asked in [who] if len(who) == 1 else [who[:1], who[1:], who]:
        wide = TURNS[len(asked)] if turn is None else turn if asked == who else min(turn, TURNS[1])
        if needed < longest:
            needed = max(needed, _flooded(plane, asked, start, goal, margin, longest, wide))
    return min(needed, longest)


def _positioners(plane: FocalPlane, given: Sequence[int]) -> list[int]:
    """One or two that can move, by number.

    Raises:
        ProblemError: others, or no numbers.
    """
    who = np.asarray(given)
    known = who.dtype.kind in "iu" and who.ndim == 1 and len(who) in TURNS and len(set(who.tolist())) == len(who)
    if not (known and np.all((who >= 0) & (who < plane.n)) and plane.online[who].all()):
        raise ProblemError(f"one or two positioners that can move are asked about, by number, got {shortened(given)}")
    return [int(i) for i in who]


def _configuration(angles: np.ndarray, name: str, n: int) -> np.ndarray:
    """(n, 2) [rad].

    Raises:
        ProblemError: of another shape, or not finite; a goal may be NaN.
    """
    angles = read_only(angles, unit="rad", name=name, error=ProblemError)
    if angles.shape != (n, 2) or np.isinf(angles).any() or (name == "start" and np.isnan(angles).any()):
        raise ProblemError(f"{name} must be finite angles of shape ({n}, 2), got shape {angles.shape}")
    return angles


def _flooded(
    plane: FocalPlane,
    who: list[int],
    start: np.ndarray,
    goal: np.ndarray,
    margin: float,
    longest: float,
    turn: float,
) -> float:
    """How long it is until the flood comes to the goal [s]; 0 where there is nothing to be flooded past."""
    beside = _beside(plane, who, margin)
    if not beside or plane.kinematics.has_avoidance:
        return 0.0
    ends = np.where(np.isnan(goal), start, goal)
    if any(_is_shut(plane, who, beside, angles, margin - BELOW) for angles in (start, ends)):
        return 0.0
    cells = _cells(plane, who, start, goal, longest, turn)
    free = _free(plane, who, beside, start, cells, longest, margin - BELOW)
    here, spread, lines = np.zeros_like(free), np.zeros_like(free), np.zeros((4, free.shape[3]), np.uint64)
    steps = int(first_step(cells, longest, free, here, spread, lines))
    return longest if steps < 0 else (steps - 1) * cells.step


def _beside(plane: FocalPlane, who: list[int], margin: float) -> list[tuple[int, int]]:
    """Pairs that may touch: those that move, and each of them with what never moves, which comes first."""
    fixed = np.concatenate([~plane.online, np.ones(len(plane.obstacles), bool)])
    pairs = [(a, b) for pair in plane.arm_pairs_within(margin).tolist() for a, b in (pair, pair[::-1])]
    return [(a, b) for a, b in pairs if b in who and (fixed[a] or (a in who and a == who[0]))]


def _is_shut(
    plane: FocalPlane, who: list[int], beside: list[tuple[int, int]], angles: np.ndarray, margin: float
) -> bool:
    """Whether these may not be at `angles` (n, 2) [rad]: out of their ranges, or too near."""
    if not ((plane.lower <= angles) & (angles <= plane.upper))[who].all():
        return True
    return not (signed_clearances(plane.arms, plane.with_obstacles(angles), np.array(beside)) >= margin).all()


def _cells(
    plane: FocalPlane, who: list[int], start: np.ndarray, goal: np.ndarray, seconds: float, turn: float
) -> Cells:
    """Cells that a motion of so many seconds can come to; one joint of one cell for each that is not asked about."""
    idle = 4 - 2 * len(who)

    def of(values: np.ndarray, otherwise: float) -> np.ndarray:
        return np.concatenate([np.full(idle, otherwise), values[who].ravel()])

    begin, end, speed = of(start, 0.0), of(goal, 0.0), of(plane.max_speed, 0.0)
    lower, upper = of(plane.lower, -0.5), of(plane.upper, 0.5)
    aside = np.isnan(end)
    low = np.maximum(lower, np.where(aside, begin - speed * seconds, 0.5 * (begin + end - speed * seconds)))
    high = np.minimum(upper, np.where(aside, begin + speed * seconds, 0.5 * (begin + end + speed * seconds)))
    while True:
        step = turn / float(plane.max_speed[who].max())
        width = np.where(speed > 0, speed * step, 1.0)
        first, last = np.floor((low - begin) / width), np.ceil((high - begin) / width)
        words = np.prod(last[:3] - first[:3] + 3.0) * ((last[3] - first[3] + 1.0) // BITS + 1.0)
        if words <= _MOST_WORDS and words * seconds <= _MOST_WORK * step:
            cells = first.astype(np.int64), (last - first).astype(np.int64) + 1
            return Cells(begin, end, lower, upper, speed, step, width, *cells)
        turn *= 1.25


def _free(
    plane: FocalPlane,
    who: list[int],
    beside: list[tuple[int, int]],
    start: np.ndarray,
    cells: Cells,
    seconds: float,
    margin: float,
) -> np.ndarray:
    """(words, a, b, c) the cells in which nobody is nearer than the margin all over, as bits."""
    size, stand = cells.size, plane.with_obstacles(start)
    free = np.zeros((size[3] // BITS + 1, *(size[:3] + 2)), np.uint64)
    for w in range(len(free)):
        free[w, 1:-1, 1:-1, 1:-1] = (1 << min(BITS, int(size[3]) - BITS * w)) - 1
    stack = np.zeros((_STACK, 8), np.int64)
    for a, b in beside:
        arms = (a, b) if b == who[-1] else (b, a)  # who moves alone, or is second of two, has the last slots
        moves = np.isin(arms, who)
        pose = np.concatenate([stand[arms[0]], stand[arms[1]]])
        shut(plane.arms, *arms, moves, pose, cells, seconds, margin, free, stack)
    return free
