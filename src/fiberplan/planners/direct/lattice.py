"""Joint space and time as the direct planner searches them: nodes for each joint, steps of equal length.

Every positioner has a lattice of its own, whose spacing is what its joints turn in one step at full speed, or a whole
part of that: its pace is how many nodes a joint may go in a step. It passes through the goal, and the start is one node
more. So a move within the pace never exceeds a speed limit, and neither end needs rounding. Obstacles follow the
positioners and never move.

A positioner for whom there is only one way past what never moves (`fiberplan.planners.direct.passages`) has a lattice
of that way alone: its alpha nodes are the places it is at after each step, one beta node and what `ways` adds to it
being the betas there. It may wait and go back, but nowhere else.
"""

from typing import Any, NamedTuple

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.kernels.compile import inlined
from fiberplan.planners.direct.extents import extents
from fiberplan.planners.direct.nodes import MOST_BETAS, nodes_of
from fiberplan.tolerances import UNDER_LIMIT


class Lattice(NamedTuple):
    """Nodes, and everybody's motion over them; `path` and `fixed` change while the planner searches."""

    alpha: np.ndarray  #: (n, A) nodes, increasing, then NaN [rad]
    beta: np.ndarray  #: (n, B) [rad]
    way: np.ndarray  #: (n,) row of `ways`
    ways: np.ndarray  #: (m, A) added to beta at each alpha node [rad]: nothing in row 0
    size: np.ndarray  #: (n, 2) how many
    pace: np.ndarray  #: (n, 2) how many nodes a joint may go in a step
    first: np.ndarray  #: (n, 2) the node of the start
    last: np.ndarray  #: (n, 2) the node of the goal; -1: anywhere safe
    path: np.ndarray  #: (arms, steps + 1, 2) where each arm is after each step [rad]
    circle: np.ndarray  #: (arms, 3) center in its frame and radius of a circle about the bodies of the last link [mm]
    first_link: np.ndarray  #: (arms,) how far bodies on the first link are from the base [mm]; negative: none there
    fixed: np.ndarray  #: (arms,) never moves
    delay: int = 0  #: steps by which one may be late, or earlier than another, and still not touch
    apart: np.ndarray = np.zeros(0)  #: (pairs,) clearance that they keep then [mm]

    @property
    def steps(self) -> int:
        """How many steps there are."""
        return self.path.shape[1] - 1


@inlined
def late_limit(lattice, pair):
    """Clearance that a pair keeps where either is late [mm]."""
    return lattice.apart[pair] if lattice.delay > 0 else 0.0


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
    pace = np.ones((n, 2), np.int64)
    nodes = nodes_of(plane, np.arange(n), start, goal, duration, steps, widest, pace)
    path = np.zeros((len(arms.arm), steps + 1, 2))
    path[:n] = start[:, None]
    fixed = np.ones(len(arms.arm), bool)
    fixed[:n] = ~movable
    alpha, beta, size, first, last = nodes
    way, ways = np.zeros(n, np.int64), np.zeros((1, alpha.shape[1]))
    return Lattice(alpha, beta, way, ways, size, pace, first, last, path, *extents(arms), fixed)


def refined(
    lattice: Lattice,
    plane: FocalPlane,
    who: np.ndarray,
    pace: np.ndarray,
    start: np.ndarray,
    goal: np.ndarray,
    duration: float,
    steps: int,
    widest: np.ndarray,
) -> Lattice:
    """The same with nodes for positioners `who` (m,) at another `pace` (m, 2); their paths stay as they are.

    The rest as for `make_lattice`.
    """
    full = np.minimum(plane.max_speed[who, 1] * UNDER_LIMIT * duration, widest[1])
    travel = np.nan_to_num(np.abs(goal[who, 1] - start[who, 1])) / full
    pace = pace.copy()
    pace[:, 1] = np.clip((MOST_BETAS - 6) // np.maximum(np.ceil(travel), 1), 1, pace[:, 1])  # a set is one word
    finer = nodes_of(plane, who, start[who], goal[who], duration, steps, widest, pace)
    changed: dict[str, Any] = {"pace": lattice.pace.copy(), "way": lattice.way.copy()}
    changed["pace"][who], changed["way"][who] = pace, 0
    for name in ("alpha", "beta"):
        old, new = getattr(lattice, name), getattr(finer, name)
        both = np.full((len(old), max(old.shape[1], new.shape[1])), np.nan)
        both[:, : old.shape[1]] = old
        both[who] = np.nan
        both[who, : new.shape[1]] = new
        changed[name] = both
    for name in ("size", "first", "last"):
        changed[name] = getattr(lattice, name).copy()
        changed[name][who] = getattr(finer, name)
    wider = changed["alpha"].shape[1] - lattice.alpha.shape[1]
    return lattice._replace(ways=np.pad(lattice.ways, ((0, 0), (0, wider))), **changed)


def on_its_way(lattice: Lattice, i: int, way: np.ndarray) -> Lattice:
    """The same with positioner i on a `way` (m, 2) [rad] from start to goal, each place one step from the last."""
    count = len(way)
    wider = max(0, count - lattice.alpha.shape[1])
    alpha = np.pad(lattice.alpha, ((0, 0), (0, wider)), constant_values=np.nan)
    ways = np.pad(lattice.ways, ((0, 1), (0, wider)))
    alpha[i], alpha[i, :count], ways[-1, :count] = np.nan, way[:, 0], way[:, 1]
    changed: dict[str, Any] = {
        name: getattr(lattice, name).copy() for name in ("beta", "way", "size", "pace", "first", "last")
    }
    changed["beta"][i], changed["beta"][i, 0] = np.nan, 0.0
    changed["way"][i] = len(ways) - 1
    changed["size"][i], changed["pace"][i] = (count, 1), 1
    changed["first"][i], changed["last"][i] = 0, (count - 1, 0)
    return lattice._replace(alpha=alpha, ways=ways, **changed)


def lengthened(lattice: Lattice, steps: int) -> Lattice:
    """The same with more steps, in which everybody stands where they ended."""
    extra = steps - lattice.steps
    path = np.concatenate([lattice.path, np.repeat(lattice.path[:, -1:], extra, axis=1)], axis=1)
    return lattice._replace(path=path)


def fewest_steps(lattice: Lattice) -> int:
    """In how many steps everybody gets from start to goal, were nothing in anyone's way."""
    far = np.ceil(np.abs(lattice.last - lattice.first) / lattice.pace).max(axis=1)
    return int(far[lattice.last[:, 0] >= 0].max(initial=0))


@inlined
def window(lattice, i, k, steps):
    """First and last alpha node that positioner i can be at after step k, coming from its start, going to its goal."""
    return window_of(lattice, i, 0, k, steps)


@inlined
def window_of(lattice, i, d, k, steps):
    """The same for its joint d."""
    pace, goal = lattice.pace[i, d], lattice.last[i, d]
    gone, left = k * pace, (steps - k) * pace
    low, high = max(0, lattice.first[i, d] - gone), min(lattice.size[i, d] - 1, lattice.first[i, d] + gone)
    if goal >= 0:
        low, high = max(low, goal - left), min(high, goal + left)
    return low, high


@inlined
def in_time(lattice, i, steps):
    """Whether positioner i gets from its start to its goal in so many steps, were nothing in its way."""
    far_a = abs(lattice.last[i, 0] - lattice.first[i, 0]) - steps * lattice.pace[i, 0]
    far_b = abs(lattice.last[i, 1] - lattice.first[i, 1]) - steps * lattice.pace[i, 1]
    return lattice.last[i, 0] < 0 or (far_a <= 0 and far_b <= 0)


@inlined
def between(lattice, i, d, steps):
    """First and last node of joint d that positioner i can pass on a path to its goal of so many steps."""
    first, last, most = lattice.first[i, d], lattice.last[i, d], lattice.size[i, d] - 1
    far = steps * lattice.pace[i, d]
    if last < 0:
        return max(0, first - far), min(most, first + far)
    spare = max(far - abs(last - first), 0) // 2
    return max(0, min(first, last) - spare), min(most, max(first, last) + spare)


@inlined
def beta_at(lattice, i, a, b):
    """Beta of positioner i at node (a, b) [rad]."""
    return lattice.beta[i, b] + lattice.ways[lattice.way[i], a]


@inlined
def put(lattice, i, k, a, b):
    """Positioner i is at node (a, b) after step k."""
    lattice.path[i, k, 0], lattice.path[i, k, 1] = lattice.alpha[i, a], beta_at(lattice, i, a, b)
