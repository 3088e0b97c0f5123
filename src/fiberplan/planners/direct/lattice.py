"""Joint space and time as the direct planner searches them: nodes for each joint, steps of equal length.

Every positioner has a lattice of its own, whose spacing is what its joints turn in one step at full speed and which
passes through its goal; its start is one node more. So a move to an adjacent node never exceeds a speed limit, and
neither end needs rounding. Obstacles follow the positioners and never move.

The size of a lattice is bounded whatever the speeds and ranges: a move has at most `MOST_STEPS` steps, a beta
`MOST_BETAS` nodes, and an alpha those of its move and a turn beyond either end.
"""

from typing import NamedTuple

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.kernels.arms import Arms
from fiberplan.kernels.compile import inlined, kernel
from fiberplan.tolerances import UNDER_LIMIT

MOST_BETAS = 64  #: nodes of the second joint: a set of them is one machine word
MOST_STEPS = 128  #: of the move that takes longest; beyond that steps last longer, and nodes lie farther apart
_ASIDE = 2.0 * np.pi  # [rad] beyond start and goal that an alpha may turn on its path: once around
_SAME = 1e-12  # [rad] a node this close to the start is the start


class Lattice(NamedTuple):
    """Nodes, and everybody's motion over them; `path` and `fixed` change while the planner searches."""

    alpha: np.ndarray  #: (n, A) nodes, increasing, then NaN [rad]
    beta: np.ndarray  #: (n, B) [rad]
    size: np.ndarray  #: (n, 2) how many
    first: np.ndarray  #: (n, 2) the node of the start
    last: np.ndarray  #: (n, 2) the node of the goal; -1: anywhere safe
    path: np.ndarray  #: (arms, steps + 1, 2) where each arm is after each step [rad]
    circle: np.ndarray  #: (arms, 3) center in its frame and radius of a circle about the bodies of the last link [mm]
    first_link: np.ndarray  #: (arms,) how far bodies on the first link are from the base [mm]; negative: none there
    fixed: np.ndarray  #: (arms,) never moves

    @property
    def steps(self) -> int:
        """How many steps there are."""
        return self.path.shape[1] - 1


@inlined
def _count(low, high, through, spacing):
    """Nodes `through` + m `spacing` within [low, high]: the first m, and how many."""
    first = int(np.ceil((low - through) / spacing - 1e-9))
    last = int(np.floor((high - through) / spacing + 1e-9))
    return min(first, 0), max(last, 0) - min(first, 0) + 1


@kernel
def _place_nodes(low, high, through, start, spacing, nodes, size, first, last):
    """Fill `nodes` (n, most) of one joint for every positioner, and where its start and `through` are among them."""
    for i in range(len(size)):
        m, count = _count(low[i], high[i], through[i], spacing[i])
        placed, filled = False, 0
        for k in range(count):
            x = through[i] + (m + k) * spacing[i]
            x = min(max(x, low[i]), high[i])
            if not placed and abs(x - start[i]) <= _SAME:
                x, placed = start[i], True
                first[i] = filled
            elif not placed and x > start[i]:
                nodes[i, filled], first[i] = start[i], filled
                placed = True
                filled += 1
            if m + k == 0:
                last[i] = filled
                x = start[i] if abs(x - start[i]) <= _SAME else through[i]
            nodes[i, filled] = x
            filled += 1
        if not placed:
            nodes[i, filled], first[i] = start[i], filled
            filled += 1
        size[i] = filled


class StepLength(NamedTuple):
    """How long steps may last, and how far apart nodes may lie however long they last."""

    longest: float  #: [s]
    widest: np.ndarray  #: (2,) spacing of nodes [rad]


def step_length(plane: FocalPlane, start: np.ndarray, goal: np.ndarray, turn: float) -> StepLength:
    """Steps in which no alpha turns by more than `turn` [rad]; by more where a beta has too far to go for that.

    A joint that is much slower than the fastest needs longer steps, or its lattice would have too many nodes. In those
    the fast joints use part of their speed only: they have many more steps than they need.
    """
    travel = np.nan_to_num(np.abs(goal - start))[:, 1]
    speed, most = plane.max_speed, MOST_BETAS - 8
    fastest = speed.max(axis=0)
    unit = max(turn / fastest[0], travel.max(initial=0.0) / fastest[1] / most)
    longest = max(unit, (travel / speed[:, 1]).max(initial=0.0) / most)
    return StepLength(float(longest), fastest * unit)


def _ranges(
    plane: FocalPlane, start: np.ndarray, through: np.ndarray, spacing: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Joint ranges (n, 2) to search [rad]: what lies around the move, which is all where that is not too many nodes."""
    ends = np.minimum(start, through), np.maximum(start, through)
    aside = (
        np.minimum(float(MOST_BETAS), np.ceil(_ASIDE / spacing[:, 0])),
        np.floor((MOST_BETAS - 4 - (ends[1] - ends[0])[:, 1] / spacing[:, 1]) / 2),
    )
    around = np.stack(aside, axis=1) * spacing
    return np.maximum(plane.lower, ends[0] - around), np.minimum(plane.upper, ends[1] + around)


def _extents(arms: Arms, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Circles (arms, 3) about the bodies of each last link or obstacle, and reach (arms,) of those on first links."""
    count = len(arms.arm)
    circle, first_link = np.tile([0.0, 0.0, -np.inf], (count, 1)), np.full(count, -1.0)
    for i in range(count):
        own = arms.piece[arms.arm["first_piece"][i] : arms.arm["last_piece"][i]]
        for link in (0, 1, 2):
            there = own[own["link"] == link]
            if not len(there):
                continue
            points = np.concatenate([arms.vertices[p["first"] : p["last"]] for p in there])
            radii = np.repeat(there["radius"], there["last"] - there["first"])
            if link == 1:
                first_link[i] = (np.hypot(*points.T) + radii).max()
            else:
                center = 0.5 * (points.min(axis=0) + points.max(axis=0))
                circle[i] = *center, (np.hypot(*(points - center).T) + radii).max()
    return circle, first_link


def make_lattice(
    plane: FocalPlane,
    start: np.ndarray,
    goal: np.ndarray,
    movable: np.ndarray,
    duration: float,
    steps: int,
    widest: np.ndarray,
) -> Lattice:
    """The lattice of a problem with everybody standing at the start.

    Args:
        plane: the array.
        start: (n, 2) [rad].
        goal: (n, 2) [rad]; NaN rows: anywhere safe.
        movable: (n,) who may move.
        duration: of a step [s].
        steps: how many.
        widest: (2,) nodes lie no farther apart than this [rad], unless the goal would be too many steps away.
    """
    n, arms = plane.n, plane.arms
    through = np.where(np.isnan(goal), start, goal)
    spacing = np.minimum(plane.max_speed * UNDER_LIMIT * duration, np.maximum(widest, np.abs(through - start) / steps))
    low, high = _ranges(plane, start, through, spacing)
    most = np.floor((high - low) / spacing).astype(np.int64).max(axis=0) + 3
    nodes = [np.full((n, most[d]), np.nan) for d in (0, 1)]
    size, first, last = (np.zeros((n, 2), np.int64) for _ in range(3))
    for d in (0, 1):
        own = [np.ascontiguousarray(x[:, d]) for x in (low, high, through, start, spacing)]
        _place_nodes(*own, nodes[d], size[:, d], first[:, d], last[:, d])
    last[np.isnan(goal[:, 0])] = -1
    path = np.zeros((len(arms.arm), steps + 1, 2))
    path[:n] = start[:, None]
    fixed = np.ones(len(arms.arm), bool)
    fixed[:n] = ~movable
    return Lattice(nodes[0], nodes[1], size, first, last, path, *_extents(arms, n), fixed)


def lengthened(lattice: Lattice, steps: int) -> Lattice:
    """The same with more steps, in which everybody stands where they ended."""
    extra = steps - lattice.steps
    path = np.concatenate([lattice.path, np.repeat(lattice.path[:, -1:], extra, axis=1)], axis=1)
    return lattice._replace(path=path)


@inlined
def window(lattice, i, k, steps):
    """First and last alpha node that positioner i can be at after step k, coming from its start, going to its goal."""
    low, high = max(0, lattice.first[i, 0] - k), min(lattice.size[i, 0] - 1, lattice.first[i, 0] + k)
    goal = lattice.last[i, 0]
    if goal >= 0:
        low, high = max(low, goal - (steps - k)), min(high, goal + (steps - k))
    return low, high


@inlined
def between(lattice, i, d, steps):
    """First and last node of joint d that positioner i can pass on a path to its goal of so many steps."""
    first, last, most = lattice.first[i, d], lattice.last[i, d], lattice.size[i, d] - 1
    if last < 0:
        return max(0, first - steps), min(most, first + steps)
    spare = max(steps - abs(last - first), 0) // 2
    return max(0, min(first, last) - spare), min(most, max(first, last) + spare)


@inlined
def put(lattice, i, k, a, b):
    """Positioner i is at node (a, b) after step k."""
    lattice.path[i, k, 0], lattice.path[i, k, 1] = lattice.alpha[i, a], lattice.beta[i, b]
