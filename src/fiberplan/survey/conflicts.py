"""Which options touch each other at rest: the table that an allocator needs, ours or another's.

Two options of different positioners conflict if the arms, standing there, come nearer than the margin. Whatever stands
still whoever is allocated - obstacles, positioners that cannot move or have to stay - is an arm with a single option;
options that touch one of these are left out of the table, and told apart with whom they touch.

Time and memory grow linearly with the number of options: only neighbours are compared, and each has as many options as
targets lie within its reach.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from fiberplan.arrays import Frozen, read_only
from fiberplan.focal_plane import FocalPlane
from fiberplan.kernels.arms import frame
from fiberplan.kernels.clearance import clearance_within
from fiberplan.kernels.compile import inlined, kernel
from fiberplan.kernels.neighbours import grown
from fiberplan.problem import Problem, State
from fiberplan.survey.catalogue import Catalogue
from fiberplan.survey.options import Options, options_of
from fiberplan.survey.standing import standing
from fiberplan.tolerances import EQUALITY


@dataclass(frozen=True, eq=False)
class Blocked(Frozen):
    """Options that nobody can take, since they touch what stands still."""

    options: Options
    by: np.ndarray  #: (m,) the first of what each of them touches; -1 - k is obstacle k

    def __len__(self) -> int:
        return len(self.by)


class ConflictTable(csr_array):
    """A symmetric (m, m) csr_array of bool over `options`: True where two options touch at rest.

    Options of one positioner exclude each other, and so do options on one target: neither is stored. `options` is None
    for what scipy makes of a table, such as its transpose.
    """

    options: Options  #: what rows and columns are
    blocked: Blocked  #: options that are no rows, and why

    @classmethod
    def of(cls, options: Options, pairs: np.ndarray, blocked: Blocked) -> "ConflictTable":
        """A table of which options touch.

        Args:
            options: rows and columns.
            pairs: (k, 2) of options that touch, each once.
            blocked: options that nobody can take.
        """
        ends = np.concatenate([pairs, pairs[:, ::-1]]) if len(pairs) else pairs
        m = len(options)
        table = cls((np.ones(len(ends), bool), (ends[:, 0], ends[:, 1])), shape=(m, m))
        table.sort_indices()
        table.options, table.blocked = options, blocked
        return table


def conflicts(
    plane: FocalPlane,
    targets: Any,
    margin: float = 0.0,
    *,
    start: State | np.ndarray | None = None,
    stay: Any = None,
    position_error: Any = None,
) -> ConflictTable:
    """All options of a catalogue, and which of them touch: CSR rows and columns are `table.options`.

    An outside allocator picks a set of options of which no two are of one positioner, of one target, or True in the
    table; `fp.Problem` then accepts their angles as a goal at the same margin::

        table = fp.survey.conflicts(plane, "catalogue.ecsv", margin=0.8)
        robot, target = table.options.positioner, table.options.target
        touching = table.indices[table.indptr[k] : table.indptr[k + 1]]      # the options that option k touches

    Args:
        plane: the array; positioners that are offline stand where `start` says, or folded.
        targets: a `Catalogue`, or what `Catalogue.of` takes; a `Targets` counts whoever its rows are assigned to.
        margin: clearance to keep [mm].
        start: where everyone stands now: a state, or (n, 2) commanded angles [rad]; folded unless given.
        stay: ids or indices of positioners that keep their place, or (n,) flags; nobody unless given.
        position_error: (n,) or shared: more room for some, each arm's own, on top of the margin [mm].

    Raises:
        TargetError: targets that cannot be used, or of a fiber that `plane` has not.
        ProblemError: a margin, start or position error that makes no sense, or a positioner that does not exist.
    """
    there = standing(plane, start, stay, margin, position_error)
    return touching_options(there, options_of(there.plane, Catalogue.of(targets), there.plane.online))


def touching_options(there: Problem, moving: Options) -> ConflictTable:
    """Which of the options of those that can move touch each other, or what stands still.

    Args:
        there: a problem without goals, as `fiberplan.survey.standing.standing` makes it.
        moving: options of positioners that are online in it.
    """
    plane, limit = there.roomy, there.margin + EQUALITY
    fixed = np.concatenate([np.flatnonzero(~plane.online), np.arange(plane.n, plane.n + len(plane.obstacles))])
    arm = np.concatenate([moving.positioner, fixed])
    angles = np.concatenate([moving.angles, plane.with_obstacles(there.start)[fixed]])
    order = np.argsort(arm, kind="stable")
    first = np.searchsorted(arm[order], np.arange(plane.n + len(plane.obstacles) + 1))
    pairs = plane.arm_pairs_within(limit)
    found = _touching(plane.arms, pairs, read_only(first, np.int64), read_only(angles[order]), limit)
    found = order[found]  # options, and those that stand still counted after them
    m = len(moving)
    by = np.full(len(arm), -1, np.int64)
    at_rest = found[(found >= m).any(axis=1)]
    at_rest.sort(axis=1)
    by[at_rest[::-1, 0]] = arm[at_rest[::-1, 1]]  # of several the first
    free = by[:m] < 0
    place = np.cumsum(free) - 1
    kept = found[(by[found] < 0).all(axis=1) & (found < m).all(axis=1)]
    kept = kept[moving.target[kept[:, 0]] != moving.target[kept[:, 1]]]  # those on one target exclude each other anyway
    who = np.array([plane.public(arm) for arm in by[:m][~free]], np.int64)
    return ConflictTable.of(moving.kept(free), place[kept], Blocked(moving.kept(~free), read_only(who, np.int64)))


@kernel
def _touching(arms, pairs, first, angles, limit):
    """Pairs of options (k, 2) of different arms that do not keep `limit` [mm]; arm i has first[i] to first[i + 1]."""
    frames = np.empty((len(angles), 12))
    for i in range(len(first) - 1):
        for a in range(first[i], first[i + 1]):
            frames[a] = frame(arms, i, angles[a, 0], angles[a, 1])
    found = np.empty((4 * len(angles) + 16, 2), np.int64)
    count = 0
    for k in range(len(pairs)):
        i, j = pairs[k, 0], pairs[k, 1]
        for a in range(first[i], first[i + 1]):
            frame_a = _as_frame(frames, a)
            for b in range(first[j], first[j + 1]):
                gap = clearance_within(arms, i, frame_a, j, _as_frame(frames, b), limit, limit)
                if not (gap >= limit):
                    if count == len(found):
                        found = grown(found)
                    found[count, 0], found[count, 1] = a, b
                    count += 1
    return found[:count].copy()


@inlined
def _as_frame(frames, a):
    """A row of `frames` as kernels take it."""
    f = frames[a]
    return f[0], f[1], f[2], f[3], f[4], f[5], f[6], f[7], f[8], f[9], f[10], f[11]
