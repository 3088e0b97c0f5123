"""Still pictures: the focal plane at one moment of a plan, in the page's colours.

Shapes are the true ones. A rounded convex piece is the hull of a disc at each of its vertices, so an arm is drawn as
wide as it is planned. Figures are made without matplotlib's global state, so they can be drawn anywhere.
"""

import io
import os
from collections.abc import Sequence

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from scipy.spatial import ConvexHull

from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.bodies import Body
from fiberplan.focal_plane.outlines import convex_pieces
from fiberplan.plan import Outcome, Plan
from fiberplan.tables.atomic import write_whole
from fiberplan.visuals import style

_ARC = 24  # corners that stand for a full circle
_RC = {
    "font.size": 10,
    "axes.edgecolor": style.MUTED.light,
    "axes.labelcolor": style.INK.light,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": style.LINE.light,
    "grid.linewidth": 0.6,
    "xtick.color": style.MUTED.light,
    "ytick.color": style.MUTED.light,
    "legend.frameon": False,
}


def blank(size: Sequence[float] = (6.4, 4.2), rows: int = 1, columns: int = 1) -> tuple[Figure, list[Axes]]:
    """A figure in this project's style and its axes, row by row, tied to no window and to no global state.

    Args:
        size: width and height [inch].
        rows: of axes.
        columns: of axes.
    """
    with rc_context(_RC):
        figure = Figure(figsize=(size[0], size[1]), layout="constrained", facecolor=style.PAPER.light)
        FigureCanvasAgg(figure)
        axes = list(figure.subplots(rows, columns, squeeze=False).flat)
        for ax in axes:
            ax.set_prop_cycle(color=style.SERIES)
    return figure, axes


def save(figure: Figure, path: str | os.PathLike, dpi: int = 160) -> None:
    """Write a figure as PNG, whole or not at all.

    Raises:
        PlanError: the file cannot be written.
    """
    content = io.BytesIO()
    figure.savefig(content, format="png", dpi=dpi)
    write_whole(path, content.getvalue())


def draw_plan(plan: Plan, path: str | os.PathLike, time: float | None = None) -> None:
    """Draw the focal plane at `time` [s] (by default the end), coloured by outcome, as a PNG.

    Raises:
        PlanError: the file cannot be written.
    """
    plane = plan.problem.plane
    time = plan.makespan if time is None else float(time)
    figure, (ax,) = blank((10.5, 9.0))
    draw_configuration(ax, plane, plan.trajectory.at(time), plan.outcomes)
    _draw_goals(ax, plan, plan.trajectory.at(time))
    verdict = "proven safe" if plan.certificate.ok else "not safe"
    ax.set_title(f"{plane.name}: {plan}, {verdict}", color=style.INK.light, fontweight="bold", pad=10, loc="left")
    ax.set_xlabel(f"x [mm]      t = {time:.1f} s of {plan.makespan:.1f} s")
    ax.set_ylabel("y [mm]")
    with rc_context(_RC):
        ax.legend(handles=_legend(plan), loc="upper left", bbox_to_anchor=(1.0, 1.0), labelcolor=style.INK.light)
    save(figure, path)


def draw_configuration(ax: Axes, plane: FocalPlane, angles: np.ndarray, outcomes: Sequence[Outcome]) -> None:
    """Draw all positioners at `angles` (n, 2) [rad] and the obstacles, on axes of equal scale."""
    for obstacle in plane.obstacles:
        pieces = [rounded(piece, obstacle.radius) for piece in convex_pieces(obstacle.points, obstacle.closed)]
        ax.add_collection(PolyCollection(pieces, facecolor=style.OBSTACLE.light, edgecolor="none", zorder=1))
    for links in plane.kinematics.skeleton(plane, angles):
        ax.add_collection(LineCollection(list(links), colors=style.MUTED.light, linewidths=0.8, zorder=2))
    colours = np.array([style.OUTCOMES[outcome].light for outcome in outcomes])
    for body in sorted(plane.bodies, key=lambda body: body.link == "beta"):
        where, shapes = _placed(plane, body, angles)
        faces = colours[where] if body.link == "beta" else style.LINE.light
        rim = 0.3 if len(shapes) == plane.n else 0.0  # pieces of one body touch, and a rim would show their seams
        ax.add_collection(PolyCollection(shapes, facecolor=faces, edgecolor=style.PAPER.light, linewidth=rim, zorder=3))
    ax.set_aspect("equal")
    ax.grid(False)
    ax.autoscale_view()
    ax.margins(0.02)


def rounded(piece: np.ndarray, radius: float) -> np.ndarray:
    """Outline (k, 2) of a convex `piece` (v, 2) grown by `radius`; its arcs are drawn with straight chords."""
    if radius <= 0 and len(piece) < 3:
        return piece
    turns = np.arange(_ARC) * 2 * np.pi / _ARC
    disc = radius * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    cloud = (piece[:, None] + disc[None]).reshape(-1, 2) if radius > 0 else piece
    return cloud[ConvexHull(cloud).vertices]


def _placed(plane: FocalPlane, body: Body, angles: np.ndarray) -> tuple[np.ndarray, list[np.ndarray]]:
    """Outlines of a body on every positioner, in focal-plane coordinates, and whose they are."""
    origin, turn = plane.kinematics.frames(plane, angles)[body.link]
    radius = np.broadcast_to(body.radius, plane.n)
    alike = body.points.ndim == 2 and np.ndim(body.radius) == 0
    shared = [rounded(piece, radius[0]) for piece in body.pieces(0)] if alike else None
    where, shapes = [], []
    for i in range(plane.n):
        c, s = np.cos(turn[i]), np.sin(turn[i])
        for outline in shared if shared is not None else [rounded(piece, radius[i]) for piece in body.pieces(i)]:
            where.append(i)
            shapes.append(outline @ np.array([[c, s], [-s, c]]) + origin[i])
    return np.array(where, dtype=np.int64), shapes


def _draw_goals(ax: Axes, plan: Plan, angles: np.ndarray) -> None:
    """A dot on every target that is reached; a cross on a lost one, and a line to it from the fiber."""
    plane = plan.problem.plane
    goals, fibers = plane.fibers(plan.problem.requested), plane.fibers(angles)
    kept = plan.having(Outcome.ARRIVED)
    ax.scatter(*goals[kept].T, s=2, color=style.PAPER.light, linewidths=0, zorder=5)
    lost = np.array([i for i in plan.lost if np.isfinite(goals[i]).all()], dtype=np.int64)
    if len(lost):
        colours = [style.OUTCOMES[plan.outcomes[i]].light for i in lost]
        away = np.stack([fibers[lost], goals[lost]], axis=1)
        ax.add_collection(LineCollection(list(away), colors=colours, linestyles=":", linewidths=1.2, zorder=6))
        ax.scatter(*goals[lost].T, s=90, marker="x", color=style.PAPER.light, linewidths=4, zorder=7)
        ax.scatter(*goals[lost].T, s=70, marker="x", color=colours, linewidths=2, zorder=8)


def _legend(plan: Plan) -> list[Patch | Line2D]:
    counts = {outcome: len(plan.having(outcome)) for outcome in style.OUTCOMES}
    handles: list[Patch | Line2D] = [
        Patch(facecolor=colour.light, label=f"{style.LABELS[outcome]}  {counts[outcome]}")
        for outcome, colour in style.OUTCOMES.items()
        if counts[outcome]
    ]
    if len(plan.lost):
        cross = Line2D([], [], marker="x", linestyle="", markeredgewidth=2, color=style.MUTED.light)
        cross.set_label("lost target")
        handles.append(cross)
    if plan.problem.plane.obstacles:
        handles.append(Patch(facecolor=style.OBSTACLE.light, label="obstacle"))
    return handles
