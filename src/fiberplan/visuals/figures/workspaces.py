"""What an array can do whatever the plan: who reaches where, and who can touch whom."""

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection, PolyCollection
from matplotlib.colors import to_hex
from matplotlib.patches import Patch

from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.coverage import coverage as covered
from fiberplan.plan import Plan
from fiberplan.visuals import style
from fiberplan.visuals.canvas import WIDE, blank, keyed, titled
from fiberplan.visuals.figures.registry import FIGURES
from fiberplan.visuals.shapes import fixed_outlines, span

_POINTS = 480  # along the longer side of a map
_LISTED = 12  # rows of a legend


@FIGURES.register("coverage")
def coverage(
    plan: Plan | FocalPlane, ax: Axes | None = None, fiber: str | None = None, step: float | None = None
) -> Axes:
    """Draw by how many positioners each point of the focal plane is reached (Sayres2021, Fig. 4).

    Positioners that cannot move count for none. The legend has the shares of the area that anybody reaches.

    Args:
        plan: or a focal plane.
        ax: to draw on; those of a new figure unless given.
        fiber: which fiber is to get there; the default one unless given.
        step: between the points of the map [mm]; 480 along the longer side unless given.

    Raises:
        InstrumentError: no such fiber, or a step that makes no map.
    """
    ax = blank((WIDE, 5.6))[1][0] if ax is None else ax
    plane = _plane(plan)
    step = float((span(plane)[1] - span(plane)[0]).max()) / _POINTS if step is None else step
    found = covered(plane, step, fiber)
    most = int(found.reached.max())
    colours = _ramp(most)
    pixels = np.ones((*found.reached.shape, 4))
    for k, colour in enumerate(colours, 1):
        pixels[found.reached == k] = [int(colour[n : n + 2], 16) / 255 for n in (1, 3, 5)] + [1.0]
    edges = [found.x[0] - step / 2, found.x[-1] + step / 2, found.y[0] - step / 2, found.y[-1] + step / 2]
    ax.imshow(pixels, extent=edges, origin="lower", interpolation="nearest", zorder=0)
    labels = [
        f"{k}: {share:.1%}" if share >= 0.001 else f"{k}: below 0.1%" for k, share in enumerate(found.shares(), 1)
    ]
    _map(ax, plane, colours, labels, "reached by")
    titled(ax, f"{plane.name}: how many fibers reach each point", "x [mm]", "y [mm]")
    return ax


@FIGURES.register("multiplicity")
def multiplicity(plan: Plan | FocalPlane, ax: Axes | None = None, margin: float | None = None) -> Axes:
    """Draw with how many others, obstacles included, each positioner could come into contact (Sayres2021, Fig. 7).

    Two could if the discs that their bodies sweep come within the margin, whatever their joints' ranges and heights.

    Args:
        plan: or a focal plane.
        ax: to draw on; those of a new figure unless given.
        margin: closer than this is a contact [mm]; that of the plan, or 0, unless given.

    Raises:
        InstrumentError: the margin is no length.
    """
    ax = blank((WIDE, 5.6))[1][0] if ax is None else ax
    plane = _plane(plan)
    if margin is None:
        margin = plan.problem.margin if isinstance(plan, Plan) else 0.0
    counts = possible_contacts(plane, margin)
    kinds, how_many = np.unique(counts, return_counts=True)
    ramp = _ramp(len(kinds))
    size = np.full(plane.n, _spacing(plane.base))
    faces = np.array(ramp)[np.searchsorted(kinds, counts)]
    discs = EllipseCollection(size, size, np.zeros(plane.n), units="xy", offsets=plane.base,
                              offset_transform=ax.transData, facecolors=faces, edgecolors=style.PAPER.light,
                              linewidths=0.5, zorder=2)  # fmt: skip
    ax.add_collection(discs)
    _map(ax, plane, ramp, [f"{k}: {n} positioners" for k, n in zip(kinds, how_many, strict=True)], "possible contacts")
    title = f"{plane.name}: with how many others contact is possible (margin {margin:g} mm)"
    titled(ax, title, "x [mm]", "y [mm]")
    return ax


def possible_contacts(plane: FocalPlane, margin: float) -> np.ndarray:
    """(n,) with how many others, obstacles included, each positioner could come within `margin` [mm]."""
    pairs = plane.arm_pairs_within(margin).ravel()
    return np.bincount(pairs[pairs < plane.n], minlength=plane.n)


def _spacing(base: np.ndarray) -> float:
    """Diameter of discs that stand for positioners side by side [mm]."""
    from scipy.spatial import cKDTree

    if len(base) < 2:
        return 10.0
    return 0.96 * float(np.median(cKDTree(base).query(base, 2)[0][:, 1]))


def _plane(plan: Plan | FocalPlane) -> FocalPlane:
    return plan.problem.plane if isinstance(plan, Plan) else plan


def _ramp(count: int) -> list[str]:
    """So many colours from light to dark, which keep their order without colour vision."""
    return [to_hex(colormaps["viridis_r"](k)) for k in np.linspace(0.06, 1.0, max(count, 1))][:count]


def _map(ax: Axes, plane: FocalPlane, colours: list[str], labels: list[str], what: str) -> None:
    """Obstacles, limits and the legend of a map of the whole array."""
    ax.add_collection(
        PolyCollection(fixed_outlines(plane), facecolor=style.PAPER.light, edgecolor=style.INK.light, linewidth=0.5)
    )
    (left, bottom), (right, top) = span(plane)
    ax.set_xlim(left, right)
    ax.set_ylim(bottom, top)
    ax.set_aspect("equal")
    ax.grid(False)
    rows = [Patch(facecolor=c, label=text) for c, text in zip(colours, labels, strict=False)]
    if len(rows) > _LISTED:
        rows = [*rows[: _LISTED - 1], Patch(facecolor="none", label=f"and {len(rows) - _LISTED + 1} more")]
    keyed(ax, handles=rows, title=what, fontsize=8)
