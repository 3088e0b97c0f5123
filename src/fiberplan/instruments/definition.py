"""A focal plane from its definition: what an instrument file says (`definition_model`), and the tables beside it.

A definition describes a regular grid or lists positioners, says what all have in common, and may name tables of
positioners, of their outlines and of obstacles (``docs/instrument-format.md``).
"""

from collections.abc import Sequence
from pathlib import Path as FilePath

import numpy as np

from fiberplan.errors import InstrumentError
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.bodies import Obstacle
from fiberplan.focal_plane.four_bar import FourBar
from fiberplan.focal_plane.kinematics import Kinematics
from fiberplan.focal_plane.two_link import TWO_LINK
from fiberplan.instruments import shape_tables
from fiberplan.instruments.complaints import Complaint, DefinitionError
from fiberplan.instruments.definition_model import Definition, Fiducials
from fiberplan.instruments.locate import Path
from fiberplan.instruments.positioner_table import PositionerValues, row_of
from fiberplan.tables.input_table import InputTable
from fiberplan.tables.wording import nearest

_JOINTS = ("alpha", "beta")


def plane_of(definition: Definition, path: FilePath, tables: Sequence[InputTable], drop: bool = False) -> FocalPlane:
    """One focal plane from a definition at `path` and its tables; with `drop`, of what can be used of the tables.

    Raises:
        InstrumentError: a value that cannot be used, in a table or (`DefinitionError`) in the definition.
    """
    ids, start, discs = _places(definition, tables)
    values = PositionerValues(ids, tables, drop)
    base = _base(values, start)
    lost = np.isnan(base).any(axis=1)
    joints = definition.joints

    def both(name: str, unit: str, optional: bool = False) -> np.ndarray:
        columns = [
            values.column(
                f"{name}_{joint}", ("joints", joint, name), unit, getattr(getattr(joints, joint), name), optional
            )
            for joint in _JOINTS
        ]
        return np.stack(columns, axis=1)

    length = values.column("length", ("arm", "length"), "mm", definition.arm.length if definition.arm else None)
    lower, upper, folded = both("lower", "rad"), both("upper", "rad"), both("folded", "rad")
    zero, speed, slowest = both("zero", "rad"), both("speed", "rad/s"), both("min_speed", "rad/s")
    acceleration = both("acceleration", "rad/s2", optional=True)
    mended = list(values.faults)  # where a joint's range is not its own, it holds where the joint is folded
    lower[mended], upper[mended] = np.fmin(lower, folded)[mended], np.fmax(upper, folded)[mended]
    _check_joints(values, length, lower, upper, folded)
    _check_motors(values, speed, acceleration, slowest)
    fibers = _fibers(definition, values)
    bodies = shape_tables.bodies(definition.bodies, values, path.parent)
    obstacles = (*discs, *shape_tables.obstacles(definition.obstacles, path.parent))
    forbidden = shape_tables.forbidden(definition.forbidden, path.parent)
    kinematics = _kinematics(definition, values, base)
    online = values.flags("online")
    online[list(values.faults)] = False
    _check_names(definition, values)
    notes = [*([definition.title] if definition.title else []), *definition.sources]
    if not bodies:
        notes.append("no bodies: nothing can touch")
    if values.complaints:
        raise DefinitionError(*dict.fromkeys(values.complaints))
    notes += values.unused()
    mendings = [
        f"positioner {ids[i]} is left out, nothing says where it stands: {text}"
        if lost[i]
        else f"positioner {ids[i]} is offline: {text}; where a value is missing it is taken as the usual one"
        for i, text in sorted(values.faults.items())
    ]
    try:
        plane = FocalPlane(
            ids=ids,
            base=np.where(lost[:, None], 0.0, base),
            length=length,
            fiber_offsets=fibers,
            folded=folded,
            lower=lower,
            upper=upper,
            max_speed=speed,
            zero=zero,
            online=online,
            bodies=bodies,
            obstacles=obstacles,
            name=definition.name,
            kinematics=kinematics,
            field_radius=definition.field_radius or np.inf,
            notes=(*notes, *mendings),
            assumptions=(*definition.assumptions, *mendings),
            recommended_margin=definition.margin,
            forbidden=forbidden,
            max_acceleration=np.where(np.isnan(acceleration), np.inf, acceleration),
            min_speed=slowest,
        )
        return plane.subset(np.flatnonzero(~lost)) if lost.any() else plane
    except InstrumentError as error:
        raise InstrumentError(f"{path}: {error}") from None


def _places(
    definition: Definition, tables: Sequence[InputTable]
) -> tuple[tuple[str, ...], dict[str, np.ndarray], list[Obstacle]]:
    """Ids of positioners, those of the grid first; positions by hole (2,) [mm]; and fiducials."""
    ids, places = definition.grid.places() if definition.grid else ((), np.empty((0, 2)))
    where = dict(zip(ids, places, strict=True))
    fiducials = definition.fiducials or Fiducials(radius=0.0)
    used: dict[str, str] = {}
    taken: dict[Path, list[str]] = {("grid", "empty"): definition.grid.empty if definition.grid else []}
    taken["fiducials", "holes"] = fiducials.holes
    for field, holes in taken.items():
        for hole in holes:
            if hole not in where:
                raise DefinitionError(Complaint(field, f"the grid has no hole '{hole}'{nearest(hole, ids)}"))
            if hole in used:
                raise DefinitionError(Complaint(field, f"hole '{hole}' is already used"))
            used[hole] = ".".join(map(str, field))
    for table in tables:
        for id_, row in row_of(table).items():
            if id_ in used:
                raise table.fail(row, f"hole '{id_}' has no positioner ({used[id_]})")
    listed = dict.fromkeys([id_ for id_ in ids if id_ not in used] + [id_ for table in tables for id_ in row_of(table)])
    if not listed:
        raise DefinitionError(Complaint(("grid",), "no positioner is left"))
    discs = {hole: where[hole] for hole in fiducials.holes} | {k: np.array(v) for k, v in fiducials.at.items()}
    made = [Obstacle(f"fiducial {k}", centre[None], fiducials.radius) for k, centre in discs.items()]
    return tuple(listed), where, made


def _base(values: PositionerValues, where: dict[str, np.ndarray]) -> np.ndarray:
    """Alpha axes (n, 2) [mm]: x and y, or distance and angle, or the hole of the grid."""
    start = np.array([where.get(id_, (np.nan, np.nan)) for id_ in values.ids]).reshape(-1, 2)
    distance = values.column("distance", (), "mm", optional=True)
    angle = values.column("angle", (), "rad", optional=True)
    polar = distance[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    start = np.where(np.isnan(polar), start, polar)
    base = np.stack([values.column(axis, (), "mm", start[:, k], optional=True) for k, axis in enumerate("xy")], axis=1)
    lost = np.isnan(base).any(axis=1)
    hint = nearest(values.ids[int(np.argmax(lost))], where) if lost.any() else ""
    values.check(lost, ["positioner"], (), f"neither x and y nor distance and angle say where it is{hint}")
    return base


def _check_joints(
    values: PositionerValues,
    length: np.ndarray,
    lower: np.ndarray,
    upper: np.ndarray,
    folded: np.ndarray,
) -> None:
    """Refuse values that do not go together, where they are said."""
    wrong = values.check(length < 0, ["length"], ("arm", "length"), "{} mm is negative", length)
    _replace(wrong, length)
    for k, joint in enumerate(_JOINTS):
        low, high, park = (np.degrees(array[:, k]) for array in (lower, upper, folded))
        field, names = ("joints", joint), [f"{name}_{joint}" for name in ("lower", "upper", "folded")]
        wrong = values.check(low > high, names[:2], (*field, "lower"), "lower {} deg is above upper {} deg", low, high)
        outside = (low <= high) & ((park < low) | (park > high))
        text = "folded {} deg is outside {} to {} deg"
        wrong |= values.check(outside, names[::-1], (*field, "folded"), text, park, low, high)
        _replace(wrong, lower[:, k], upper[:, k], folded[:, k])


def _check_motors(values: PositionerValues, speed: np.ndarray, acceleration: np.ndarray, slowest: np.ndarray) -> None:
    """Refuse speeds and accelerations that no motor has, where they are said."""
    for k, joint in enumerate(_JOINTS):
        fast, change, slow = (np.degrees(array[:, k]) for array in (speed, acceleration, slowest))
        field, names = ("joints", joint), [f"{name}_{joint}" for name in ("min_speed", "speed", "acceleration")]
        wrong = values.check(fast <= 0, names[1:2], (*field, "speed"), "{} deg/s is not a positive speed", fast)
        text = "{} deg/s^2 is not a positive acceleration"
        wrong |= values.check(change <= 0, names[2:], (*field, "acceleration"), text, change)
        wrong |= values.check(slow < 0, names[:1], (*field, "min_speed"), "{} deg/s is negative", slow)
        text = "least speed {} deg/s is above the largest, {} deg/s"
        wrong |= values.check(slow > fast, names[:2], (*field, "min_speed"), text, slow, fast)
        _replace(wrong, speed[:, k], acceleration[:, k], slowest[:, k])


def _replace(wrong: np.ndarray, *columns: np.ndarray) -> None:
    """Put the median of the others in place of values (n,) that are wrong."""
    for column in columns if wrong.any() else ():
        column[wrong] = np.median(column[~wrong]) if not wrong.all() else np.nan


def _fibers(definition: Definition, values: PositionerValues) -> dict[str, np.ndarray]:
    """Places of each fiber (n, 2) in the beta link's frame [mm]; NaN for who lacks it, which nobody does the first.

    Of the first, `arm` is the length along that link.
    """
    arm = values.column("arm", (), "mm", optional=True)
    fibers = {}
    for k, name in enumerate(definition.fibers):
        common = definition.fibers[name] if isinstance(definition.fibers, dict) else (np.nan, np.nan)
        straight = np.isfinite(arm) if k == 0 else np.zeros(len(arm), bool)
        some = k > 0 and values.given(f"{name}_x") and values.given(f"{name}_y")  # all carry the first
        columns = [
            values.column(f"{name}_{axis}", ("fibers", name), "mm", np.where(straight, along, place), some)
            for axis, along, place in zip("xy", (arm, 0.0 * arm), common, strict=True)
        ]
        half = np.isnan(columns[0]) != np.isnan(columns[1])
        wrong = values.check(half, [f"{name}_x", f"{name}_y"], ("fibers", name), "only one of x and y is given")
        fibers[name] = np.where(wrong[:, None], np.nan, np.stack(columns, axis=1))
    return fibers


def _kinematics(definition: Definition, values: PositionerValues, base: np.ndarray) -> Kinematics:
    """The kind of arms that stand at `base` (n, 2) [mm]."""
    part = definition.four_bar
    if part is None:
        return TWO_LINK
    lengths = {
        "spacing": (("spacing",), part.spacing),
        "rocker": (("rocker",), part.rocker),
        "shortest": (("slider", "shortest"), part.slider.shortest),
        "longest": (("slider", "longest"), part.slider.longest),
    }
    columns = {k: values.column(k, ("four_bar", *field), "mm", common) for k, (field, common) in lengths.items()}
    inward = np.degrees(np.arctan2(-base[:, 1], -base[:, 0]))
    columns["orientation"] = values.column("orientation", (), "rad", inward)
    try:
        return TWO_LINK if values.complaints else FourBar(**columns)
    except InstrumentError as error:
        raise DefinitionError(Complaint(("four_bar",), str(error))) from None


def _check_names(definition: Definition, values: PositionerValues) -> None:
    """Refuse fibers and bodies of single positioners that the instrument does not have."""
    known = {"fibers": list(definition.fibers), "radius": [body.name for body in definition.bodies]}
    for k, positioner in enumerate(definition.positioner):
        for field, names in known.items():
            for name in getattr(positioner, field):
                if name not in names:
                    what = "fiber" if field == "fibers" else "body"
                    text = f"there is no {what} '{name}'{nearest(name, names)}"
                    values.complaints.append(Complaint(("positioner", k, field), text))
