"""One fact stated twice is compared: rows that give angles and a position, and how far apart the two put the fiber.

An older calibration moves fibers by hundredths of a millimeter, another robot in the hole by one, another instrument by
tens. So most rows of a field must agree, and no single row may be far off, unless it is said which of the two counts.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from fiberplan.errors import TargetError
from fiberplan.focal_plane import FocalPlane

FIELD = 0.2  #: a field of which most rows disagree by more is refused [mm]
NOTED = 0.1  #: rows that disagree by more are noted [mm]
NAMED = 1.0  #: rows that disagree by more are named wherever the plan is told of [mm]
REFUSED = 5.0  #: rows that disagree by more are refused or dropped [mm]
_LISTED = 20  # rows that a note names


@dataclass(frozen=True)
class Agreement:
    """How well angles and positions of the same rows agree."""

    notes: tuple[str, ...] = ()  #: what belongs in the plan
    named: tuple[str, ...] = ()  #: of the notes, what a proof rests on
    apart: Mapping[int, str] = field(default_factory=dict)  #: row -> why neither can be believed


def distances(
    plane: FocalPlane, who: np.ndarray, fibers: Sequence[str], angles: np.ndarray, points: np.ndarray
) -> np.ndarray:
    """(m,) from where `angles` (m, 2) [rad] put each row's fiber to `points` (m, 2) [mm]; NaN where one is not given.

    Args:
        plane: whose geometry to use.
        who: (m,) positioner of each row; none twice.
        fibers: (m,) names as `plane` has them; "" is the default fiber.
        angles: commanded.
        points: in the focal plane.
    """
    stated = plane.folded.copy()
    stated[who] = np.where(np.isfinite(angles), angles, 0.0)
    ends, names = np.full((len(who), 2), np.nan), np.array(fibers, object)
    for name in dict.fromkeys(fibers):
        rows = names == name
        ends[rows] = plane.fibers(stated, name or None)[who[rows]]
    away = np.hypot(*(ends - points).T)
    return np.where(np.isfinite(angles).all(axis=1), away, np.nan)


def second_names_agree(
    plane: FocalPlane, who: np.ndarray, given: Sequence[str] | None, source: str, accepted: bool = False
) -> tuple[str, ...]:
    """What to note of positioners that the source calls otherwise than `plane` does: others stand in their places.

    Args:
        plane: with second names, or without.
        who: (m,) positioner of each row.
        given: (m,) second names in the source, "" where it has none; None: it has none at all.
        source: of the rows.
        accepted: whether it was said that the source counts, whatever stands there now.

    Raises:
        TargetError: most are called otherwise: the source is of another array, and it was not accepted.
    """
    if given is None or not plane.aliases:
        return ()
    both = [(plane.ids[i], plane.aliases[i], name) for i, name in zip(who, given, strict=True) if name]
    both = [each for each in both if each[1]]
    other = [f"{id_} is {name}, now {alias}" for id_, alias, name in both if alias.lower() != name.lower()]
    if not other:
        return ()
    said = f"{len(other)} of {len(both)} positioners in {source} are others than in {plane.name}"
    if not accepted and 2 * len(other) > len(both):
        raise TargetError(f"{said}: {other[0]}; another array? --prefer angles or --prefer xy takes them all the same")
    more = f" and {len(other) - _LISTED} more" if len(other) > _LISTED else ""
    return (f"{said}: {', '.join(other[:_LISTED])}{more}",)


def agreement(away: np.ndarray, names: Sequence[str], source: str, plane: str, prefer: str | None) -> Agreement:
    """What to say of the distances (m,) [mm] between angles and positions of the same rows.

    Args:
        away: as `distances` gives them.
        names: (m,) of the rows, for messages.
        source: of the rows.
        plane: name of the focal plane.
        prefer: "angles" or "xy" if it was said which counts.

    Raises:
        TargetError: most rows disagree, and it was not said which counts.
    """
    both = np.flatnonzero(np.isfinite(away))
    if not len(both):
        return Agreement()
    worst, median = int(both[np.argmax(away[both])]), float(np.median(away[both]))
    figures = f"median {median:.3f} mm, largest {away[worst]:.3f} mm ({names[worst]})"
    if prefer is None and 2 * int((away[both] > FIELD).sum()) > len(both):
        raise TargetError(
            f"{source}: angles and positions of the same rows disagree on {plane}: {figures}, of {len(both)} rows; "
            "another instrument or calibration? --prefer angles or --prefer xy says which to take"
        )
    taken = "positions" if prefer == "xy" else "angles"
    said = f"angles and positions of {len(both)} rows were compared: {figures}; the {taken} are taken"
    off = [int(row) for row in both[np.argsort(-away[both], kind="stable")] if away[row] > NOTED]
    noted = [row for row in off if away[row] <= NAMED]
    if noted:
        said += f"; {NOTED:g} to {NAMED:g} mm apart: " + (
            f"{len(noted)} rows" if len(noted) > _LISTED else _listed(noted, away, names)
        )
    far = [row for row in off if away[row] > NAMED and (prefer is not None or away[row] <= REFUSED)]
    named = (
        (f"angles and position disagree by more than {NAMED:g} mm: {_listed(far, away, names)}; the {taken} are taken",)
        if far
        else ()
    )
    apart = {
        row: f"its angles put the fiber {away[row]:.3f} mm from its position ({names[row]}); "
        "--prefer angles or --prefer xy says which to take"
        for row in off
        if prefer is None and away[row] > REFUSED
    }
    return Agreement((said, *named), named, apart)


def state_agrees(
    plane: FocalPlane,
    who: np.ndarray,
    where: Sequence[str],
    angles: np.ndarray,
    points: np.ndarray,
    fibers: Sequence[str] | None,
    online: np.ndarray | None,
    source: str,
) -> Agreement:
    """How well angles and positions of a state agree; who cannot move may have lost the target that its row names.

    Args:
        plane: whose geometry to use.
        who: (m,) positioner of each row; none twice.
        where: (m,) "line 7", for messages.
        angles: (m, 2) commanded [rad]; NaN: not said.
        points: (m, 2) where its fiber is [mm]; NaN: not said.
        fibers: (m,) which fiber; "", or None for all: the default one.
        online: (m,) whether it can move; None: all can.
        source: of the rows.

    Raises:
        TargetError: most rows disagree: they are of another focal plane.
    """
    known = {"": ""} | {name.lower(): name for name in plane.fiber_offsets}
    named = [name.lower() for name in fibers or [""] * len(who)]
    there = np.array([name in known for name in named], bool)
    points = np.where(there[:, None], points, np.nan)
    away = distances(plane, who, [known.get(name, "") for name in named], angles, points)
    if online is not None:
        away = np.where(~online & (away > NAMED), np.nan, away)
    names = [f"{plane.ids[i]} in {row}" for i, row in zip(who, where, strict=True)]
    found = agreement(away, names, source, plane.name, None)
    unknown = ", so that nobody knows where it stands"
    apart = {row: why.partition("; --")[0] + unknown for row, why in found.apart.items()}
    return Agreement(found.notes, found.named, apart)


def _listed(rows: Sequence[int], away: np.ndarray, names: Sequence[str]) -> str:
    shown = ", ".join(f"{names[row]} {away[row]:.3f} mm" for row in rows[:_LISTED])
    return shown + (f" and {len(rows) - _LISTED} more" if len(rows) > _LISTED else "")
