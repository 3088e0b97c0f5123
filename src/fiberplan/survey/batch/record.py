"""What is kept of a field: enough for every table, and for the fields after it, without opening its plan."""

from typing import Any, NamedTuple


class Slow(NamedTuple):
    """A positioner that stopped late."""

    positioner: str
    stop: float  #: when it stopped [s]
    bound: float  #: the least time of its turn [s]


class Record(NamedTuple):
    """A field that is done, or that failed."""

    field: int  #: its number, from 0
    id: str
    why: str = ""  #: it failed; empty: it did not
    candidates: tuple[tuple[str, int], ...] = ()  #: targets that were offered, by class
    taken: tuple[int, ...] = ()  #: numbers of the targets that were observed, in the order of their positioners
    positioners: tuple[int, ...] = ()  #: indices of these
    value: float = 0.0  #: total priority
    bound: float = 0.0  #: no allocation at rest has more
    price: float = 0.0  #: priority given up for the motion's sake
    short: int = 0  #: required positions that there are not
    rounds: int = 0  #: times that the motion was planned
    makespan: float = 0.0  #: [s]
    lower_bound: float = 0.0  #: the kinematic one [s]
    clearance: float | None = None  #: of the closest pair, proven [mm]; None: nothing is near
    reasons: tuple[tuple[str, str, int], ...] = ()  #: class, kind of reason, how many targets were not allocated for it
    slowest: tuple[Slow, ...] = ()
    files: tuple[tuple[str, int, str], ...] = ()  #: name, size and SHA-256 of what was written
    times: tuple[float, float, int] = (0.0, 0.0, 0)  #: CPU and wall-clock seconds, and how often it was tried

    def said(self) -> dict[str, Any]:
        """As a line of the ledger says it."""
        return self._asdict()

    @classmethod
    def heard(cls, said: dict[str, Any]) -> "Record":
        """From a line of the ledger.

        Raises:
            TypeError: fields that are missing or unknown.
            ValueError: likewise.
        """
        pairs = {name: tuple(map(tuple, said[name])) for name in ("candidates", "reasons", "files")}
        lists = {name: tuple(said[name]) for name in ("taken", "positioners", "times")}
        return cls(**{**said, **pairs, **lists, "slowest": tuple(Slow(*each) for each in said["slowest"])})
