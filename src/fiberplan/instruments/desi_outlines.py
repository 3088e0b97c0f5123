"""What can touch in DESI: outlines from ``collision_settings.conf``, made to each device's measure.

- phi: the phi arm, on the beta link; meets phi arms, theta bodies, the petal's edge and its guide camera;
- theta: the theta body, on the alpha link; meets phi arms only (two theta bodies are too far from each other);
- the petal's edge: the line that its arms may not cross. The file's outline goes around everything outside of the
  petal, its neighbours too, so it is cut down to that line; arms that begin within the petal meet it first;
- the guide camera: as the file has it.

Both fixed outlines are turned by 36 deg from petal to petal.
"""

import ast
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fiberplan.errors import InstrumentError
from fiberplan.focal_plane.bodies import Body, Obstacle
from fiberplan.tables.input_table import InputTable
from fiberplan.tables.table_reader import read_text

NAMES = ("collision_settings.conf", "_collision_settings_DEFAULT.conf")  #: beside a focal-plane file
_NOMINAL = 3.0  # lengths of the links for which the outlines are drawn [mm]
LINEAR = np.radians(5.0)  #: by which the focal-plane file turns the sides of linear phi arms outwards, at least [rad]
_SECTOR = np.pi / 5  # of a petal, from its x axis
_BEYOND = 1.5  # how far a petal's edge may lie outside its sector [mm]
_FARTHEST = 425.0  # of a petal's edge from the middle; the frame drawn around it goes farther [mm]


@dataclass(frozen=True)
class Settings:
    """A ``collision_settings.conf``: values and outlines by name."""

    source: str
    text: str

    def number(self, name: str) -> float:
        """A number, or an `InstrumentError`."""
        match = re.search(rf"^{name}[ \t]*=[ \t]*([^\s#]*)", self.text, re.M)
        if match is None:
            raise InstrumentError(f"{self.source}: no {name}")
        try:
            return float(match[1])
        except ValueError:
            raise InstrumentError(f"{self.source}: {name} is '{match[1]}', not a number") from None

    def outline(self, name: str) -> np.ndarray:
        """Points (k, 2) [mm] of an outline, which the file writes as two lists.

        Raises:
            InstrumentError: it is missing, or is not two lists of as many numbers.
        """
        match = re.search(rf"^{name}\s*=\s*'''(.*?)'''", self.text, re.M | re.S)
        if match is None:
            raise InstrumentError(f"{self.source}: no outline {name}")
        try:
            points = np.array(ast.literal_eval(match[1].strip()), float).T
        except (ValueError, TypeError, SyntaxError, MemoryError, RecursionError):
            points = np.empty(0)
        if points.ndim != 2 or points.shape[1] != 2 or len(points) < 3 or not np.isfinite(points).all():
            raise InstrumentError(f"{self.source}: {name} is not two lists of as many numbers, three or more")
        return points


def find_settings(folder: Path) -> Settings:
    """The collision settings in a folder.

    Raises:
        InstrumentError: there are none.
    """
    for name in NAMES:
        if (folder / name).is_file():
            return Settings(str(folder / name), "\n".join(read_text(folder / name, InstrumentError)))
    raise InstrumentError(f"{folder / NAMES[0]}: no such file; without it nothing is known of what can touch")


def moving_outlines(settings: Settings, table: InputTable, first: np.ndarray, second: np.ndarray) -> tuple[Body, Body]:
    """Phi arms and theta bodies of devices (rows of `table`) with links `first` and `second` (n,) [mm]."""
    linear = table.flags("LINPHI", blank=True) if "LINPHI" in table else np.zeros(len(table), bool)
    phi = _expanded(settings.outline("KEEPOUT_PHI"), table, "PHI", np.where(linear, LINEAR, 0.0))
    longer = (first - _NOMINAL) + np.maximum(second - _NOMINAL, 0.0)
    phi[..., 0] += np.where(phi[..., 0] > 0, longer[:, None], 0.0)
    theta = _expanded(settings.outline("KEEPOUT_THETA"), table, "THETA", np.zeros(len(table)))
    shared = theta[0] if np.all(theta == theta[0]) else theta
    return (
        Body(phi, 0.0, "beta", closed=True, category="phi", meets=("phi", "theta"), name="phi arm"),
        Body(shared, 0.0, "alpha", closed=True, category="theta", meets=("phi",), name="theta body"),
    )


def _expanded(outline: np.ndarray, table: InputTable, axis: str, least: np.ndarray) -> np.ndarray:
    """An outline (k, 2) as each device has it (n, k, 2) [mm]: farther out, and turned away from its x axis.

    Args:
        outline: of all.
        table: with the expansions.
        axis: PHI or THETA.
        least: (n,) by how much it is turned at least [rad].
    """

    def by(kind: str, unit: str, default: str) -> np.ndarray:
        name = f"KEEPOUT_EXPANSION_{axis}_{kind}"
        return table.numbers(name, unit, default, blank=0.0) if name in table else np.zeros(len(table))

    out, turn = by("RADIAL", "mm", "mm"), np.maximum(by("ANGULAR", "rad", "deg"), least)
    radius, angle = np.hypot(*outline.T), np.arctan2(outline[:, 1], outline[:, 0])
    radius = np.maximum(radius + out[:, None], 0.0)
    angle = angle + np.sign(angle) * turn[:, None]
    made = radius[..., None] * np.stack([np.cos(angle), np.sin(angle)], axis=2)
    same = (out == 0) & (turn == 0)
    made[same] = outline
    return made


def fixed_outlines(settings: Settings, petals: list[int]) -> tuple[Obstacle, ...]:
    """The edge and the guide camera of each petal, in the focal plane."""
    edge, camera = _edge(settings), settings.outline("KEEPOUT_GFA")
    made = []
    for number in petals:
        turn = _SECTOR * (number - 3.0)
        turned = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
        made.append(Obstacle(f"edge of petal {number}", edge @ turned, 0.0, False, "petal edge", ("phi",)))
        made.append(Obstacle(f"guide camera of petal {number}", camera @ turned, 0.0, True, "camera", ("phi",)))
    return tuple(made)


def _edge(settings: Settings) -> np.ndarray:
    """The line (k, 2) [mm] that bounds a petal: the part of the file's outline that lies about its own sector."""
    outline = settings.outline("KEEPOUT_PTL")
    x, y = outline.T
    within = (y > -_BEYOND) & (y * np.cos(_SECTOR) - x * np.sin(_SECTOR) < _BEYOND) & (np.hypot(x, y) < _FARTHEST)
    first = int(np.argmin(within)) if not within.all() else 0
    order = np.roll(np.arange(len(outline)), -first)
    line = outline[order][within[order]]
    runs = np.count_nonzero(within & ~np.roll(within, 1))
    if runs != 1 or len(line) < 3:
        raise InstrumentError(f"{settings.source}: KEEPOUT_PTL does not go around a petal between 0 and 36 deg")
    return line
