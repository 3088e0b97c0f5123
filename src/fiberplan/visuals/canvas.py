"""Blank figures in this project's style, and figures as files.

They are made without matplotlib's global state, so they can be drawn anywhere. The same figure gives the same bytes.
"""

import io
import os
from collections.abc import Sequence
from pathlib import Path

from matplotlib import rc_context
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from fiberplan.errors import FiberplanError, PlanError
from fiberplan.tables.atomic import write_whole
from fiberplan.visuals import style

WIDE = 7.2  #: [inch] both columns of a journal's page
_DATED = {"svg": "Date", "pdf": "CreationDate", "png": "Software"}  # what would differ from run to run
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
    "legend.labelcolor": style.INK.light,
    "svg.hashsalt": "fiberplan",
    "pdf.fonttype": 42,  # text stays text
}
FORMATS = tuple(_DATED)


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


def titled(ax: Axes, title: str, x: str, y: str) -> None:
    """Give axes their words."""
    ax.set_title(title, loc="left", color=style.INK.light, fontweight="bold", fontsize=10)
    ax.set_xlabel(x)
    ax.set_ylabel(y)


def keyed(ax: Axes, **how: object) -> None:
    """Give axes a legend of what is labelled on them, in this project's style; to their right unless told otherwise."""
    with rc_context(_RC):
        ax.legend(**{"fontsize": 9, "alignment": "left", "loc": "upper left", "bbox_to_anchor": (1.0, 1.0), **how})


def keyed_below(axes: Sequence[Axes], handles: Sequence[Artist], columns: int) -> None:
    """Give axes that share a figure one legend below them all."""
    with rc_context(_RC):
        figure = axes[0].get_figure()
        figure.legend(handles=handles, loc="outside lower center", ncols=columns, fontsize=8, handlelength=2.6)


def save(figure: Figure, path: str | os.PathLike, dpi: int = 160) -> None:
    """Write a figure in the format that the name's ending says, whole or not at all.

    Args:
        figure: to write.
        path: ends in .svg, .pdf or .png.
        dpi: pixels per inch, of a PNG.

    Raises:
        FiberplanError: the name ends otherwise, or (a PlanError) the file cannot be written.
    """
    write_whole(path, rendered(figure, figure_format(path), dpi), PlanError)


def rendered(figure: Figure, kind: str, dpi: int = 160) -> bytes:
    """A figure as bytes of one of `FORMATS`, at so many pixels per inch if it is a PNG."""
    content = io.BytesIO()
    with rc_context(_RC):
        figure.savefig(
            content, format=kind, dpi=dpi, metadata={_DATED[kind]: None}, bbox_inches="tight", pad_inches=0.06
        )
    return content.getvalue()


def figure_format(path: str | os.PathLike) -> str:
    """What the name of a figure's file ends in.

    Raises:
        FiberplanError: in nothing that a figure can be written as.
    """
    kind = Path(path).suffix.lower().removeprefix(".")
    if kind not in FORMATS:
        raise FiberplanError(
            f"{os.fspath(path)}: a figure's name ends in .{', .'.join(FORMATS[:-1])} or .{FORMATS[-1]}"
        )
    return kind
