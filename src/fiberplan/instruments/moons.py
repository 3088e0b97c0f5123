"""The configuration files of the MOONS prototype (``positioners.cfg``), as ESO parameter files.

Commanded angles are the motors': alpha is counted from ``ORIENT`` and beta from folded, so both are 0 at the datum, and
the beta of the papers (measured from the alpha link) is pi more. Centres are polar, with theta from +y towards +x. The
zones that may not touch, and what meets what, are described at `zones`; each is the file's own shape padded by SAFETY.
The file gives no motor speeds and no outline of the acquisition cameras: see `SPEED` and `_cameras`.
"""

import os
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from fiberplan.errors import InstrumentError
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.bodies import Body, Obstacle
from fiberplan.instruments.formats import focal_plane_format
from fiberplan.tables.paf import ParameterFile, read_paf

SPEED = (np.radians(16.68), np.radians(22.5))
"""Fastest turns of alpha and beta [rad/s]: 2.78 and 3.75 rpm, the prototype's (its slowest are 0.73 and 0.98 rpm)."""
BARE = 6.5  #: the arm's three pieces end this far before the fiber [mm]
INSET = 0.01  #: how far rectangles are drawn in before they are rounded so as to contain their corners [mm]
_HEALTH = "its fibre is broken"
_LOCKED = "it is locked"


@focal_plane_format("moons", "a positioners.cfg of MOONS", lambda path: path.suffix.lower() == ".cfg")
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
    ends = {name: [file.number(f"INS.POS.{name}{k}") for k in (1, 2)] for name in ("LOW", "HIGH")}
    offline = {k: _LOCKED for k in numbers if file.flag(f"INS.POS{k}.LOCK")}
    offline |= {k: _HEALTH for k in numbers if not file.flag(f"INS.FIBRE{k}.HEALTH") and k not in offline}
    for name, values in ends.items():
        for joint, value in enumerate(values, 1):
            if (value < 0) != (name == "LOW"):
                raise file.fail(f"INS.POS.{name}{joint}", f"is {value:g}, so the datum at 0 deg is out of range")
    folded = np.zeros((n, 2))
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
        max_speed=np.tile(SPEED, (n, 1)),
        bodies=zones(file),
        obstacles=_cameras(file, base),
        zero=np.stack([orient, np.full(n, np.pi)], axis=1),
        online=np.array([k not in offline for k in numbers]),
        name=f"moons-{path.resolve().parent.name}",
        notes=(
            f"from {path.name}: MOONS prototype, lengths, ranges and avoidance zones as in the file",
            "motor speeds of 2.78 and 3.75 rpm are the prototype's; the file does not give them",
            "acquisition cameras are drawn as the cells they occupy and touch nothing; the file gives no outline",
            *(f"positioner {k} is taken as offline: {why}" for k, why in offline.items()),
        ),
    )


def zones(file: ParameterFile) -> tuple[Body, ...]:
    """What can touch, each zone at its own height (u runs from elbow to fiber).

    Each is padded by SAFETY on each side, so two fibers stay MINDIST + 2 SAFETY apart. Padded rectangles have sharp
    corners, as real fields show: feet, arms and metrology zones of goals come as close as 0.02 mm, which rounded
    corners would leave 0.2 mm apart. A body with sharp corners has no radius, and then overlap is a clearance of 0
    rather than below it; so they are drawn in by 0.01 mm and rounded by 0.014 mm, which contains the sharp shape and
    is larger than it by 0.004 mm along its sides and nowhere more. The triangle is rounded by SAFETY.

    - holder: a disc of diameter MINDIST about the fiber; meets other holders and snags;
    - metrology: a rectangle of WIDTH2 from the fiber back by B1; meets other metrology zones;
    - low, middle, high: the arm in three equal pieces of WIDTH2, from ``sqrt(((L2 - L1) / 2)^2 - (WIDTH2 / 2)^2)`` past
      the elbow to 6.5 mm before the fiber; each meets only its own kind;
    - foot: the datum actuator, a rectangle of DW from the elbow along u by DL; meets other feet;
    - snag: a triangle behind the metrology zone, its base TW2 there and its tip TB3 nearer to the elbow; meets other
      positioners' holders.
    """
    get = {k: file.number(f"INS.POS.{k}", 0.0) for k in ("LENGTH1", "LENGTH2", "WIDTH2", "MINDIST", "B1", "TB3", "TW2")}
    get |= {k: file.number(f"INS.POS.{k}", 0.0) for k in ("DL", "DW", "SAFETY")}
    fiber, half, pad = get["LENGTH2"], get["WIDTH2"] / 2, get["SAFETY"]
    neck = ((fiber - get["LENGTH1"]) / 2) ** 2 - half**2
    if neck < 0 or np.sqrt(neck) >= fiber - BARE:
        raise file.fail("INS.POS.LENGTH2", f"is {fiber:g}, which leaves no room for an arm of that WIDTH2 and LENGTH1")
    cuts = np.linspace(np.sqrt(neck), fiber - BARE, 4)
    behind = fiber - get["B1"]
    snag = [[behind, -get["TW2"] / 2], [behind, get["TW2"] / 2], [behind - get["TB3"], 0.0]]

    def rectangle(name: str, begin: float, end: float, wide: float) -> Body:
        begin, end, wide = begin - pad + INSET, end + pad - INSET, wide + pad - INSET
        corners = np.array([[begin, -wide], [end, -wide], [end, wide], [begin, wide]])
        return Body(corners, INSET * np.sqrt(2.0), closed=True, category=name, meets=(name,), name=name)

    heights = ("low", "middle", "high")
    return (
        Body(np.array([[fiber, 0.0]]), get["MINDIST"] / 2 + pad, category="holder", meets=("holder",), name="holder"),
        rectangle("metrology", behind, fiber, half),
        *(rectangle(name, a, b, half) for name, a, b in zip(heights, cuts[:-1], cuts[1:], strict=True)),
        rectangle("foot", 0.0, get["DL"], get["DW"] / 2),
        Body(np.array(snag), pad, closed=True, category="snag", meets=("holder",), name="snag"),
    )


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
    pitch = cKDTree(everyone).query(everyone, k=2)[0][:, 1].min()
    turns = np.radians(30.0 + 60.0 * np.arange(6))
    cell = pitch / np.sqrt(3.0) * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    return tuple(
        Obstacle(f"acquisition camera {k}", cell + centre, closed=True, category="camera", meets=())
        for k, centre in zip(numbers, centres, strict=True)
    )
