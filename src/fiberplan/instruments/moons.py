"""The configuration files of the MOONS prototype (``positioners.cfg``), as ESO parameter files.

Commanded angles are the motors': alpha is counted from ``ORIENT`` and beta from folded, so both are 0 at the datum, and
the beta of the papers (measured from the alpha link) is pi more. Centres are polar, with theta from +y towards +x. The
zones that may not touch, and what meets what, are in `fiberplan.instruments.moons_zones`; sizes come in two forms. A
file of the newer form gives motor speeds (FAST, in rpm) and where the datum is (DEF); one without has those of
`SPEED`, and its datum at 0. SLOW (rpm) is the least speed. No file gives an outline of the acquisition cameras: see
`_cameras`.
"""

import os
from pathlib import Path

import numpy as np

from fiberplan.errors import InstrumentError
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.bodies import Obstacle
from fiberplan.instruments.formats import focal_plane_format
from fiberplan.instruments.moons_zones import zones
from fiberplan.tables.contents import plain_name
from fiberplan.tables.paf import ParameterFile, read_paf

SPEED = (np.radians(16.68), np.radians(22.5))
"""Fastest turns of alpha and beta [rad/s]: 2.78 and 3.75 rpm, the prototype's (its slowest are 0.73 and 0.98 rpm)."""
_DRAWN = "acquisition cameras are drawn as the cells they occupy and touch nothing; the file gives no outline"
_HEALTH = "its fibre is broken"
_LOCKED = "it is locked"


@focal_plane_format("moons", "a positioners.cfg of MOONS", lambda path: plain_name(path).suffix.lower() == ".cfg")
def read_moons(path: str | os.PathLike) -> FocalPlane:
    """The focal plane of a ``positioners.cfg``; ids are the numbers of the positioners.

    A locked positioner (``LOCK "T"``: in the published files every one has "F", despite what their comment says) and
    one whose fibre is broken are offline, and a locked one is folded where its fibre is said to be.

    Raises:
        InstrumentError: no such file, or a line or value that cannot be used; one line that names it.
    """
    path = Path(path)
    file = read_paf(path, InstrumentError)
    numbers = file.numbered("INS.POS")
    if not numbers:
        raise InstrumentError(f"{path}: no positioners (keywords INS.POS<number>.RFOCAL)")
    n, length = len(numbers), file.number("INS.POS.LENGTH1", 1e-3)
    base = np.array([_place(file, f"INS.POS{k}") for k in numbers])
    orient = np.radians([file.number(f"INS.POS{k}.ORIENT") for k in numbers])
    reach = file.number("INS.POS.LENGTH2", 1e-3)
    datum = [file.number(f"INS.POS.DEF{k}") if f"INS.POS.DEF{k}" in file.values else 0.0 for k in (1, 2)]
    speed, slowest, said, unkept = _speeds(file)
    bodies, form = zones(file)
    assumed = [*form, *unkept, *([_DRAWN] if file.numbered("INS.ACQ") else [])]
    ends = {name: [file.number(f"INS.POS.{name}{k}") for k in (1, 2)] for name in ("LOW", "HIGH")}
    offline = {k: _LOCKED for k in numbers if file.flag(f"INS.POS{k}.LOCK")}
    offline |= {k: _HEALTH for k in numbers if not file.flag(f"INS.FIBRE{k}.HEALTH") and k not in offline}
    for name, values in ends.items():
        for joint, value in enumerate(values, 1):
            if (value < datum[joint - 1]) != (name == "LOW"):
                at = f"the datum at {datum[joint - 1]:g} deg"
                raise file.fail(f"INS.POS.{name}{joint}", f"is {value:g}, so {at} is out of range")
    folded = np.tile(np.radians(datum), (n, 1))
    for row, k in enumerate(numbers):
        if offline.get(k) == _LOCKED:
            folded[row] = _locked_at(file, k, base[row], orient[row], (length, reach))
    return FocalPlane(
        ids=tuple(numbers),
        base=base,
        length=np.full(n, length),
        fiber_offsets={"fiber": np.array([reach, 0.0])},
        folded=folded,
        lower=np.tile(np.radians(ends["LOW"]), (n, 1)),
        upper=np.tile(np.radians(ends["HIGH"]), (n, 1)),
        max_speed=np.tile(speed, (n, 1)),
        min_speed=None if slowest is None else np.tile(slowest, (n, 1)),
        bodies=bodies,
        obstacles=_cameras(file, base),
        zero=np.stack([orient, np.full(n, np.pi)], axis=1),
        online=np.array([k not in offline for k in numbers]),
        name=f"moons-{path.resolve().parent.name}",
        notes=(
            f"from {path.name}: MOONS prototype, lengths, ranges and avoidance zones as in the file",
            *said,
            *assumed,
            *(f"positioner {k} is taken as offline: {why}" for k, why in offline.items()),
        ),
        assumptions=tuple(assumed),
    )


def _speeds(file: ParameterFile) -> tuple[np.ndarray, np.ndarray | None, list[str], list[str]]:
    """Fastest and slowest turns of both motors (2,) [rad/s], None if not said; their sources; what is not kept."""
    given = {name: any(f"INS.POS.{name}{k}" in file.values for k in (1, 2)) for name in ("FAST", "SLOW", "CHANGE")}
    slowest, notes, unkept = None, [], []
    if given["FAST"]:
        fastest = _turns(file, "FAST")
        notes.append("motor speeds of {:g} and {:g} rpm: FAST of the file".format(*np.degrees(fastest) / 6))
    else:
        fastest = np.array(SPEED)
        notes.append("motor speeds of 2.78 and 3.75 rpm are the prototype's; the file does not give them")
    if given["SLOW"]:
        slowest = _turns(file, "SLOW")
        for k in np.flatnonzero(slowest > fastest):
            raise file.fail(f"INS.POS.SLOW{k + 1}", f"is above the largest speed, {np.degrees(fastest[k]) / 6:g} rpm")
        notes.append("motors turn no slower than {:g} and {:g} rpm: SLOW of the file".format(*np.degrees(slowest) / 6))
    else:
        unkept.append(
            "motors turn as slowly as is asked: the file gives no SLOW (the prototype's are 0.73 and 0.98 rpm); "
            "`plan --for moons` keeps to what the driver takes"
        )
    if given["CHANGE"]:
        unkept.append("motors change their speed at once: CHANGE of the file is not kept but by `plan --for moons`")
    return fastest, slowest, notes, unkept


def _turns(file: ParameterFile, name: str) -> np.ndarray:
    """Speeds of both motors (2,) [rad/s], given in rpm."""
    rpm = [file.number(f"INS.POS.{name}{k}") for k in (1, 2)]
    for k, value in enumerate(rpm, 1):
        if not value > 0:
            raise file.fail(f"INS.POS.{name}{k}", f"is {value:g}, expected a speed above 0 rpm")
    return np.radians(6.0 * np.array(rpm))


def _place(file: ParameterFile, what: str) -> np.ndarray:
    """Polar coordinates, theta from +y towards +x, as x and y [mm]."""
    theta = np.radians(file.number(f"{what}.THFOCAL"))
    return file.number(f"{what}.RFOCAL", 0.0) * np.array([np.sin(theta), np.cos(theta)])


def _locked_at(
    file: ParameterFile, k: str, base: np.ndarray, orient: float, lengths: tuple[float, float]
) -> np.ndarray:
    """Motor angles (2,) at which a locked positioner's fibre is where the file says [rad]; of two, the right elbow."""
    delta = _place(file, f"INS.FIBRE{k}") - base
    distance, (first, second) = float(np.hypot(*delta)), lengths
    if not abs(second - first) - 1e-3 <= distance <= first + second + 1e-3:
        raise file.fail(f"INS.FIBRE{k}.RFOCAL", f"is {distance:.3f} mm from positioner {k}, out of its reach")
    bend = np.arccos(np.clip((distance**2 - first**2 - second**2) / (2 * first * second), -1.0, 1.0))
    alpha = np.arctan2(delta[1], delta[0]) - np.arctan2(second * np.sin(bend), first + second * np.cos(bend)) - orient
    return np.array([(alpha + np.pi) % (2 * np.pi) - np.pi, bend - np.pi])


def _cameras(file: ParameterFile, base: np.ndarray) -> tuple[Obstacle, ...]:
    """Acquisition cameras as the hexagonal cells they occupy.

    They touch nothing: the file gives their places and fields of view only, and real targets lie within 0.6 mm of a
    camera's centre, so they cannot stand in the arms' way there.
    """
    numbers = file.numbered("INS.ACQ")
    centres = np.array([_place(file, f"INS.ACQ{k}") for k in numbers]).reshape(-1, 2)
    if not len(numbers):
        return ()
    everyone = np.concatenate([base, centres])
    from scipy.spatial import cKDTree  # slow to import, and other instruments need none

    pitch = cKDTree(everyone).query(everyone, k=2)[0][:, 1].min()
    turns = np.radians(30.0 + 60.0 * np.arange(6))
    cell = pitch / np.sqrt(3.0) * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    return tuple(
        Obstacle(f"acquisition camera {k}", cell + centre, closed=True, category="camera", meets=())
        for k, centre in zip(numbers, centres, strict=True)
    )
