"""The avoidance zones of MOONS, from the sizes in a ``positioners.cfg`` of either form (u runs from elbow to fiber).

Each zone is at its own height and padded by SAFETY on each side, so two fibers stay MINDIST + 2 SAFETY apart. Padded
rectangles have sharp corners, as real fields show: feet, arms and metrology zones of goals come as close as 0.02 mm,
which rounded corners would leave 0.2 mm apart. A body with sharp corners has no radius, and then overlap is a clearance
of 0 rather than below it; so they are drawn in by 0.01 mm and rounded by 0.014 mm, which contains the sharp shape and
is larger than it by 0.004 mm along its sides and nowhere more. The triangle is rounded by SAFETY.

- holder: a disc of diameter MINDIST about the fiber; meets other holders and snags;
- metrology: a rectangle from the fiber back; meets other metrology zones;
- low, middle, high: the arm in three equal pieces of WIDTH2; each meets only its own kind;
- foot: the datum actuator, a rectangle about the elbow; meets other feet;
- snag: a triangle behind the metrology zone; meets other positioners' holders.
"""

from dataclasses import dataclass

import numpy as np

from fiberplan.focal_plane.bodies import Body
from fiberplan.tables.paf import ParameterFile

BARE = 6.5  #: the arm's three pieces end this far before the fiber, in the older form [mm]
INSET = 0.01  #: how far rectangles are drawn in before they are rounded so as to contain their corners [mm]
OLDER = ("TB3", "TW2", "DL")  #: keywords of the older form only
NEWER = ("B2", "B3", "B4", "W3", "W4", "D1", "D2")  #: keywords of the newer form only
_LARGER = (
    "the file does not say towards which end the rectangle overhangs by B2, and whether D1 counts D2: zones are drawn "
    "as large as either sense makes them, the arm's from B4 to where the metrology rectangle begins"
)


@dataclass(frozen=True)
class _Sizes:
    """Sizes of the zones [mm], whichever the form."""

    fiber: float  # from the elbow
    holder: float  # diameter
    metrology: tuple[float, float, float]  # begin, end, width
    arm: tuple[float, float, float]
    foot: tuple[float, float, float]
    snag: tuple[float, float, float]  # base, tip, width
    safety: float


def zones(file: ParameterFile) -> tuple[tuple[Body, ...], list[str]]:
    """The zones as bodies, and notes on what the file leaves open.

    Raises:
        InstrumentError: a size is missing (of a file that mixes both forms all that are) or cannot be used.
    """
    newer = _is_newer(file)
    sizes = _newer(file) if newer else _older(file)
    behind, tip, wide = sizes.snag
    snag = np.array([[behind, -wide / 2], [behind, wide / 2], [tip, 0.0]])

    def rectangle(name: str, begin: float, end: float, width: float) -> Body:
        begin, end, half = begin - sizes.safety + INSET, end + sizes.safety - INSET, width / 2 + sizes.safety - INSET
        corners = np.array([[begin, -half], [end, -half], [end, half], [begin, half]])
        return Body(corners, INSET * np.sqrt(2.0), closed=True, category=name, meets=(name,), name=name)

    holder = np.array([[sizes.fiber, 0.0]])
    begin, end, width = sizes.arm
    cuts = np.linspace(begin, end, 4)
    heights = ("low", "middle", "high")
    return (
        Body(holder, sizes.holder / 2 + sizes.safety, category="holder", meets=("holder",), name="holder"),
        rectangle("metrology", *sizes.metrology),
        *(rectangle(name, a, b, width) for name, a, b in zip(heights, cuts[:-1], cuts[1:], strict=True)),
        rectangle("foot", *sizes.foot),
        Body(snag, sizes.safety, closed=True, category="snag", meets=("holder",), name="snag"),
    ), [_LARGER] if newer else []


def _is_newer(file: ParameterFile) -> bool:
    """Whether the file is of the newer form.

    Raises:
        InstrumentError: it has keywords of both forms, or not all of one.
    """
    missing: dict[tuple[str, ...], list[str]] = {
        form: [name for name in form if f"INS.POS.{name}" not in file.values] for form in (OLDER, NEWER)
    }
    newer = len(missing[NEWER]) < len(NEWER)
    if not newer and len(missing[OLDER]) == len(OLDER):
        raise file.error(_either(file, missing))
    mixed = newer and len(missing[OLDER]) < len(OLDER)
    if missing[NEWER if newer else OLDER]:
        text = _either(file, missing) if mixed else _without(file, missing[NEWER if newer else OLDER])
        raise file.error(text)
    return newer


def _without(file: ParameterFile, names: list[str]) -> str:
    return f"{file.source}: no keyword {', '.join(f'INS.POS.{name}' for name in names)}"


def _either(file: ParameterFile, missing: dict[tuple[str, ...], list[str]]) -> str:
    older, newer = (", ".join(f"INS.POS.{name}" for name in missing[form]) for form in (OLDER, NEWER))
    return f"{file.source}: the sizes of the zones are of two forms, and neither is whole: no {older}, and no {newer}"


def _older(file: ParameterFile) -> _Sizes:
    """Sizes as most published files have them: an arm from where it leaves the first link's foot."""
    get = {k: file.number(f"INS.POS.{k}", 0.0) for k in ("LENGTH1", "LENGTH2", "WIDTH2", "MINDIST", "B1", "TB3", "TW2")}
    get |= {k: file.number(f"INS.POS.{k}", 0.0) for k in ("DL", "DW", "SAFETY")}
    fiber = get["LENGTH2"]
    neck = ((fiber - get["LENGTH1"]) / 2) ** 2 - (get["WIDTH2"] / 2) ** 2
    if neck < 0 or np.sqrt(neck) >= fiber - BARE:
        raise file.fail("INS.POS.LENGTH2", f"is {fiber:g}, which leaves no room for an arm of that WIDTH2 and LENGTH1")
    behind = fiber - get["B1"]
    return _Sizes(
        fiber=fiber,
        holder=get["MINDIST"],
        metrology=(behind, fiber, get["WIDTH2"]),
        arm=(float(np.sqrt(neck)), fiber - BARE, get["WIDTH2"]),
        foot=(0.0, get["DL"], get["DW"]),
        snag=(behind, behind - get["TB3"], get["TW2"]),
        safety=get["SAFETY"],
    )


def _newer(file: ParameterFile) -> _Sizes:
    """Sizes of the newer form, where each size has its own name; see `_LARGER`."""
    names = ("LENGTH2", "WIDTH2", "MINDIST", "B1", *NEWER, "DW", "SAFETY")
    get = {k: file.number(f"INS.POS.{k}", 0.0) for k in names}
    fiber = get["LENGTH2"]
    behind = fiber - get["B1"]
    if get["B4"] >= behind:
        raise file.fail("INS.POS.B4", f"is {get['B4']:g}, which leaves no room for an arm before the metrology zone")
    return _Sizes(
        fiber=fiber,
        holder=get["MINDIST"],
        metrology=(behind, fiber + get["B2"], get["W4"]),
        arm=(get["B4"], behind, get["WIDTH2"]),
        foot=(-get["D2"], get["D1"], get["DW"]),
        snag=(behind, behind - get["B3"], get["W3"]),
        safety=get["SAFETY"],
    )
