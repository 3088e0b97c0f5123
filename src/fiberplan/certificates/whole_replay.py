"""The whole replay of a plan file: every pair, on all cores, and everything else that the file claims.

A file that follows from one that has been replayed, as after `amend`, need not be replayed whole: a pair of arms of
which nothing differs (geometry, knots, who can move, position errors, margin, what is said of their start) is as safe
in the one file as in the other, since nothing else decides on it.
"""

import multiprocessing
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

from fiberplan.certificates.replay import Claims
from fiberplan.certificates.replay_geometry import about, geometry_fault
from fiberplan.certificates.replay_outcomes import faults, label, not_replayed
from fiberplan.cores import cores

_CHUNK = 32  # pairs that are handed to a process at a time
_WORTH = 200  # pairs from which on more processes than one pay

_here: list[Claims] = []  # of a process that judges pairs


@dataclass(frozen=True)
class Replay:
    """What a replay found."""

    faults: tuple[str, ...]  #: claims that do not hold, or are not shown to
    notes: tuple[str, ...]  #: what is not replayed, or is no claim
    judged: int  #: pairs
    taken: int  #: pairs that are as in the file that was replayed before
    about: str  #: which geometry, in words


def replay(
    claims: Claims,
    since: Claims | None = None,
    jobs: int | None = None,
    report: Callable[[str], None] | None = None,
) -> Replay:
    """Replay the claims of a plan file.

    Args:
        claims: of the file.
        since: those of a file that has been replayed, and held: pairs that are the same in both are taken from it.
        jobs: processes; one for each core unless given.
        report: told how far things are.

    Raises:
        BadFileError: columns that are missing, or hold what they cannot.
    """
    pairs = list(claims.pairs())
    todo = pairs if since is None else list(_changed(claims, since, pairs))
    found, done = [*geometry_fault(claims), *faults(claims)], 0
    for chunk in _judged(claims, todo, jobs or cores()):
        found += [f"{label(claims, i)} and {label(claims, j)}: {fault}" for (i, j), fault in chunk if fault is not None]
        done += len(chunk)
        if report is not None:
            report(f"{done} of {len(todo)} pairs")
    return Replay(tuple(found), tuple(not_replayed(claims)), len(todo), len(pairs) - len(todo), about(claims))


def _judged(claims: Claims, pairs: list, jobs: int) -> Iterator[list[tuple]]:
    """(pair, fault) of all pairs, in chunks and in order."""
    chunks = [pairs[k : k + _CHUNK] for k in range(0, len(pairs), _CHUNK)]
    forks = "fork" in multiprocessing.get_all_start_methods()  # balls cannot be sent to a process, only inherited
    _begin(claims)
    if jobs == 1 or len(pairs) < _WORTH or not forks:
        yield from map(_judge, chunks)
        return
    with ProcessPoolExecutor(jobs, multiprocessing.get_context("fork"), _begin, (claims,)) as pool:
        try:
            yield from pool.map(_judge, chunks)
        finally:
            pool.shutdown(cancel_futures=True)


def _begin(claims: Claims) -> None:
    """What a process knows before it judges."""
    _here[:] = [claims]


def _judge(pairs: list[tuple[int, int]]) -> list[tuple]:
    return [(pair, _here[0].judge(*pair)) for pair in pairs]


def _changed(new: Claims, old: Claims, pairs: list[tuple[int, int]]) -> Iterator[tuple[int, int]]:
    """Pairs of which anything differs between two files."""
    arms = range(len(new.arms))
    fixed = (new.n, len(new.arms), new.margin) == (old.n, len(old.arms), old.margin)
    same = [fixed and _of(new, arm) == _of(old, arm) for arm in arms]
    for i, j in pairs:
        if not (same[i] and same[j] and new.opening.get((i, j)) == old.opening.get((i, j))):
            yield i, j


def _of(claims: Claims, arm: int) -> tuple:
    """All that decides on the pairs of an arm, comparable."""
    own = [(s.link, s.points.tobytes(), s.parts, s.hollow, s.radius, s.category, s.meets) for s in claims.arms[arm]]
    if arm >= claims.n:
        return (own,)
    place, bar, knots = (values[arm].tobytes() for values in (claims.place, claims.bar, claims.knots))
    return own, place, bar, knots, bool(claims.online[arm]), float(claims.error[arm]), label(claims, arm)
