"""An order of fields that shortens the motion between them, within windows of visibility.

The cost from field to field is a bound: the least time in which the slowest positioner that has a target in both can
turn from one to the other. Nearest neighbour, then reversals of a stretch (2-opt, Croes 1958) and moves of up to three
fields elsewhere (or-opt, Or 1976), as long as one of them shortens the night; the first found is taken, so the order is
the same everywhere.
"""

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.errors import ProblemError
from fiberplan.focal_plane import FocalPlane
from fiberplan.plan import Plan
from fiberplan.problem import State
from fiberplan.survey.allocation import Allocation

_SEGMENT = 3  # fields that are moved together
_ROUNDS = 100  # of improving; each shortens the motion, so that few are needed
_LESS = 1e-9  # [s] by which an order must be shorter


class Order(NamedTuple):
    """Fields in an order."""

    fields: tuple[int, ...]  #: indices, as they are observed
    seconds: float  #: bounds on the motion, summed [s]
    given: float  #: the same, of the fields in the order that they were given in [s]; inf if windows rule that out
    left_out: tuple[int, ...] = ()  #: indices of those that no place was found for within their windows


def order(
    fields: Sequence[Plan | Allocation],
    state: State | np.ndarray | None = None,
    *,
    windows: Any = None,
    exposure: Any = 0.0,
) -> Order:
    """An order that shortens the motion.

    Args:
        fields: what is observed: allocations, or plans to them, all of one focal plane.
        state: where everyone stands before the first, or (n, 2) angles [rad]; folded unless given.
        windows: (k, 2) from when to when each field can be observed, whole exposure included [s]; always unless given.
            One may begin before its window opens to move, and waits then.
        exposure: (k,) or shared, how long each is observed [s].

    Raises:
        ProblemError: no fields, fields of different focal planes, or windows or exposures that make no sense.
    """
    if not fields:
        raise ProblemError("order: there are no fields")
    planes = [each.problem.plane for each in fields]
    if any(plane.ids != planes[0].ids for plane in planes):
        raise ProblemError("order: the fields are of different focal planes")
    k, plane = len(fields), planes[0]
    begin = plane.folded if state is None else state.angles if isinstance(state, State) else state
    begin = read_only(begin, unit="rad", name="order: state", error=ProblemError)
    if begin.shape != (plane.n, 2):
        raise ProblemError(f"order: a state of shape {begin.shape} for {plane.n} positioners")
    night = _Night(_costs(plane, begin, [_goals(each) for each in fields]), *_windows(windows, exposure, k))
    path, left_out = night.nearest_first()
    path = night.improved(path)
    left_out = [f for f in left_out if not night.insert(path, f)]
    path = night.improved(path)
    given = list(range(k))
    as_given = night.motion(given) if night.ends(given) < np.inf else np.inf
    return Order(tuple(path), night.motion(path), as_given, tuple(left_out))


def _goals(field: Plan | Allocation) -> np.ndarray:
    """(n, 2) where those with a target end [rad]; NaN for everyone else."""
    if isinstance(field, Plan):
        return np.where(field.problem.has_goal[:, None], field.trajectory.end, np.nan)
    goal = np.full((field.problem.n, 2), np.nan)
    goal[field.positioners] = field.table.options.angles[field.chosen]
    return goal


def _costs(plane: FocalPlane, begin: np.ndarray, goals: Sequence[np.ndarray]) -> np.ndarray:
    """(k + 1, k) least time from field to field [s]; the last row is from the beginning."""
    stacked = np.stack(goals)
    costs = np.zeros((len(goals) + 1, len(goals)))
    for row, here in enumerate([*goals, begin]):
        times = plane.least_time(np.moveaxis(stacked - here, 0, 1)).max(axis=2)  # (n, k)
        costs[row] = np.fmax.reduce(np.where(np.isnan(times), 0.0, times), axis=0)
    return costs


def _windows(windows: Any, exposure: Any, k: int) -> tuple[np.ndarray, np.ndarray]:
    seconds = read_only(exposure, unit="s", name="order: exposure", error=ProblemError)
    if seconds.shape not in ((), (k,)) or not (np.isfinite(seconds) & (seconds >= 0)).all():
        raise ProblemError(f"order: exposure must be a time of 0 s or more, or {k} of them")
    if windows is None:
        return np.tile([0.0, np.inf], (k, 1)), np.broadcast_to(seconds, k)
    limits = read_only(windows, unit="s", name="order: windows", error=ProblemError)
    if limits.shape != (k, 2) or np.isnan(limits).any() or (limits[:, 0] > limits[:, 1]).any():
        raise ProblemError(f"order: windows must be {k} rows of a beginning and a later end [s]")
    return limits, np.broadcast_to(seconds, k)


class _Night:
    """Costs and constraints of one night."""

    def __init__(self, costs: np.ndarray, windows: np.ndarray, exposure: np.ndarray):
        self._costs, self._windows, self._exposure = costs.tolist(), windows.tolist(), exposure.tolist()
        self._always = bool((windows[:, 0] <= 0).all() and np.isinf(windows[:, 1]).all())

    def motion(self, path: Sequence[int]) -> float:
        """Bounds on the motion, summed [s]."""
        costs = self._costs
        return sum(costs[a][b] for a, b in zip([len(costs) - 1, *path], path, strict=False))

    def ends(self, path: Sequence[int]) -> float:
        """When the last field has been observed [s]; inf if one is outside its window."""
        now, here = 0.0, len(self._costs) - 1
        for field in path:
            begin, end = self._windows[field]
            now = max(now + self._costs[here][field], begin) + self._exposure[field]
            if now > end:
                return np.inf
            here = field
        return now

    def nearest_first(self) -> tuple[list[int], list[int]]:
        """Always the field that can be begun soonest, ties to the one whose window ends first; and who is left out."""
        path: list[int] = []
        left = list(range(len(self._windows)))
        now, here = 0.0, len(self._costs) - 1
        while left:
            found = []
            for field in left:
                begin, end = self._windows[field]
                at = max(now + self._costs[here][field], begin)
                if at + self._exposure[field] <= end:
                    found.append((at, end, field))
            if not found:
                break
            at, _, here = min(found)
            now = at + self._exposure[here]
            path.append(here)
            left.remove(here)
        return path, left

    def insert(self, path: list[int], field: int) -> bool:
        """Put a field where it lengthens the night least, if windows let it anywhere."""
        tried = [(self.ends([*path[:k], field, *path[k:]]), k) for k in range(len(path) + 1)]
        ends, place = min(tried)
        if ends == np.inf:
            return False
        path.insert(place, field)
        return True

    def improved(self, path: list[int]) -> list[int]:
        """The path after all changes that shorten the motion and keep to the windows."""
        best = self.motion(path)
        for _ in range(_ROUNDS):
            before = best
            for i, j, other in self._changes(len(path)):
                change = self._gain(path, i, j, other)
                if change > -_LESS:
                    continue
                tried = _changed(path, i, j, other)
                if self._always or self.ends(tried) < np.inf:
                    path, best = tried, best + change
            if best > before - _LESS:
                break
        return path

    @staticmethod
    def _changes(k: int) -> Iterator[tuple[int, int, int]]:
        """(i, j, -1): path[i:j] reversed; (i, j, p): path[i:j] put before what is then at place p."""
        for i in range(k - 1):
            for j in range(i + 2, k + 1):
                yield i, j, -1
        for length in range(1, _SEGMENT + 1):
            for i in range(k - length + 1):
                for place in range(k - length + 1):
                    if place != i:
                        yield i, i + length, place

    def _gain(self, path: list[int], i: int, j: int, place: int) -> float:
        """How much longer a change makes the motion [s]; costs are symmetric, so only what joins stretches counts."""
        costs, start = self._costs, len(self._costs) - 1

        def step(a: int, b: int | None) -> float:
            return 0.0 if b is None else costs[a][b]

        before = path[i - 1] if i else start
        after = path[j] if j < len(path) else None
        first, last = path[i], path[j - 1]
        if place < 0:
            return step(before, last) + step(first, after) - step(before, first) - step(last, after)
        rest = place if place < i else place + (j - i)
        left = start if place == 0 else path[place - 1] if place <= i else path[rest - 1]
        right = path[rest] if rest < len(path) else None
        taken = step(before, after) - step(before, first) - step(last, after)
        return taken + step(left, first) + step(last, right) - step(left, right)


def _changed(path: list[int], i: int, j: int, place: int) -> list[int]:
    if place < 0:
        return [*path[:i], *path[i:j][::-1], *path[j:]]
    rest = [*path[:i], *path[j:]]
    return [*rest[:place], *path[i:j], *rest[place:]]
