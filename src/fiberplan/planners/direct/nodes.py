"""Nodes of joints: how far apart, how many, and where start and goal are among them.

The size of a lattice is bounded whatever the speeds and ranges: a move has at most `MOST_STEPS` steps, a beta fewer
than `MOST_BETAS` nodes, and an alpha those of its move and a turn beyond either end.
"""

from typing import NamedTuple

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.kernels.compile import inlined, kernel
from fiberplan.tolerances import UNDER_LIMIT

MOST_BETAS = 64  #: there are fewer nodes of the second joint: a set of them, and a mark, is one machine word
MOST_STEPS = 128  #: of the move that takes longest; beyond that steps last longer, and nodes lie farther apart
PACES = np.array([(1, 1), (2, 2), (4, 2)])  #: nodes that alpha and beta may go in a step, by fineness
MOST_PACE = int(PACES.max())
_ASIDE = 2.0 * np.pi  # [rad] beyond start and goal that an alpha may turn on its path: once around
_SAME = 1e-12  # [rad] a node this close to the start is the start


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


class Nodes(NamedTuple):
    """The nodes of some positioners."""

    alpha: np.ndarray  #: (m, A), increasing, then NaN [rad]
    beta: np.ndarray  #: (m, B) [rad]
    size: np.ndarray  #: (m, 2) how many
    first: np.ndarray  #: (m, 2) the node of the start
    last: np.ndarray  #: (m, 2) the node of the goal; -1: anywhere safe


def _ranges(
    limits: tuple[np.ndarray, np.ndarray], start: np.ndarray, through: np.ndarray, spacing: np.ndarray, pace: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Joint ranges (m, 2) to search [rad]: what lies around the move, which is all where that is not too many nodes."""
    ends = np.minimum(start, through), np.maximum(start, through)
    aside = (
        np.minimum(float(MOST_BETAS) * pace[:, 0], np.ceil(_ASIDE / spacing[:, 0])),
        np.floor((MOST_BETAS - 4 - (ends[1] - ends[0])[:, 1] / spacing[:, 1]) / 2),
    )
    around = np.stack(aside, axis=1) * spacing
    return np.maximum(limits[0], ends[0] - around), np.minimum(limits[1], ends[1] + around)


def nodes_of(
    plane: FocalPlane,
    who: np.ndarray,
    start: np.ndarray,
    goal: np.ndarray,
    duration: float,
    steps: int,
    widest: np.ndarray,
    pace: np.ndarray,
) -> Nodes:
    """The nodes of positioners `who` (m,), of rows `start` and `goal` (m, 2) [rad], at a `pace` (m, 2)."""
    through = np.where(np.isnan(goal), start, goal)
    full = np.minimum(
        plane.max_speed[who] * UNDER_LIMIT * duration, np.maximum(widest, np.abs(through - start) / steps)
    )
    spacing = full / pace
    low, high = _ranges((plane.lower[who], plane.upper[who]), start, through, spacing, pace)
    most = np.floor((high - low) / spacing).astype(np.int64).max(axis=0, initial=0) + 3
    nodes = [np.full((len(who), most[d]), np.nan) for d in (0, 1)]
    size, first, last = (np.zeros((len(who), 2), np.int64) for _ in range(3))
    for d in (0, 1):
        own = [np.ascontiguousarray(x[:, d]) for x in (low, high, through, start, spacing)]
        _place_nodes(*own, nodes[d], size[:, d], first[:, d], last[:, d])
    last[np.isnan(goal[:, 0])] = -1
    return Nodes(nodes[0], nodes[1], size, first, last)
