"""A plan as a film: the array in motion, with the time and how much faster than real it is shown in every picture.

What stands still is drawn once. Of a frame only the arms and the words are drawn, into the same buffer, from outlines
that are moved in place. Films are MP4 (H.264; needs the extra ``movie``) or GIF.
"""

import os
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection, PathCollection
from matplotlib.path import Path as Outline

from fiberplan.errors import FiberplanError, PlanError
from fiberplan.plan import Plan
from fiberplan.tables.atomic import write_whole
from fiberplan.visuals import style
from fiberplan.visuals.canvas import blank, titled
from fiberplan.visuals.figures.arrays import draw_fixed, draw_goals
from fiberplan.visuals.shapes import Outlines, outlines, span

SUFFIXES = (".mp4", ".gif")
_WIDE = 8.0  # [inch] of the figure behind the frames, so that words grow and shrink with its pixels
_STILL = 0.6  # [s] of film at either end, in which nothing moves
_MOST_FRAMES = 20_000
_MOST_COLOURS = 48  # of a GIF: one palette for all frames keeps it small, and still areas still
_HUNDREDTH = 100  # a GIF counts in hundredths of a second


def animate(
    plan: Plan,
    path: str | os.PathLike,
    fps: float = 30.0,
    speed: float = 1.0,
    size: int = 1000,
    tell: Callable[[int, int], None] | None = None,
) -> None:
    """Write a plan as a film, whole or not at all.

    Args:
        plan: what is shown.
        path: ends in .mp4 or .gif.
        fps: pictures per second; a GIF, which counts in hundredths of a second, takes the nearest it can.
        speed: how many seconds of motion pass in a second of film.
        size: height and width [pixel].
        tell: is told how many frames are drawn, and of how many.

    Raises:
        FiberplanError: another ending, no encoder for MP4, values that make no film, or (a PlanError) the file cannot
            be written.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        raise FiberplanError(f"{os.fspath(path)}: a film's name ends in {' or '.join(SUFFIXES)}")
    if suffix == ".gif":
        fps = _HUNDREDTH / max(2, round(_HUNDREDTH / fps)) if fps > 0 else fps
    if not (0 < fps <= 240 and 0 < speed < np.inf and 200 <= size <= 4000):
        raise FiberplanError(f"{fps:g} frames a second, {speed:g} times real, {size} pixels: no such film can be made")
    if not plan.makespan * fps / speed <= _MOST_FRAMES:
        raise FiberplanError(f"a film of {plan.makespan / speed:.0f} s is too long; fewer frames, or a greater speed")
    times = frame_times(plan.makespan, fps, speed)
    encode = _as_mp4 if suffix == ".mp4" else _as_gif
    write_whole(path, encode(_told(frames(plan, times, speed, size), len(times), tell), fps), PlanError)


def speed_for(makespan: float, seconds: float = 10.0) -> float:
    """How much faster than real a motion [s] is shown for a film of about `seconds`; a round number, 1 at least."""
    wanted = makespan / max(seconds - 2 * _STILL, 1.0)
    return max(1.0, float(np.ceil(10.0 * wanted) / 10.0))


def frame_times(makespan: float, fps: float, speed: float) -> np.ndarray:
    """Moments of the motion [s] that frames show; the first and the last are held for a while."""
    still = round(_STILL * fps)
    moving = np.arange(0.0, makespan, speed / fps)
    return np.concatenate([np.zeros(still), moving, np.full(still + 1, makespan)])


def frames(plan: Plan, times: np.ndarray, speed: float = 1.0, size: int = 1000) -> Iterator[np.ndarray]:
    """Pictures (size, size, 4) of bytes at `times` [s], each valid until the next is asked for; `size` is made even."""
    figure, (ax,) = blank((_WIDE, _WIDE))
    figure.set_dpi(size // 2 * 2 / _WIDE)
    canvas = FigureCanvasAgg(figure)
    plane = plan.problem.plane
    draw_fixed(ax, plane)
    draw_goals(ax, plan, plan.trajectory.start)
    ax.set_aspect("equal")
    ax.grid(False)
    for (low, high), limit in zip(span(plane).T, (ax.set_xlim, ax.set_ylim), strict=True):
        limit(low - 2.0, high + 2.0)
    verdict = "proven safe" if plan.certificate.ok else "NOT SAFE"
    titled(ax, f"{plane.name}: {plan}, {verdict}", "x [mm]", "y [mm]")
    clock = ax.text(0.01, 0.985, "", transform=ax.transAxes, color=style.INK.light, va="top", animated=True)
    arms = [_Moving(ax, plan, some) for some in outlines(plane)]
    links = [LineCollection(list(lines), colors=style.MUTED.light, linewidths=0.7, animated=True)
             for lines in plane.kinematics.skeleton(plane, plan.trajectory.start)]  # fmt: skip
    for lines in links:
        ax.add_collection(lines, autolim=False)
    canvas.draw()
    still = canvas.copy_from_bbox(figure.bbox)
    shown = "real time" if speed == 1 else f"{speed:g} x real speed"
    for time in times:
        canvas.restore_region(still)
        angles = plan.trajectory.at(float(time))
        for collection, lines in zip(links, plane.kinematics.skeleton(plane, angles), strict=True):
            collection.set_segments(list(lines))
            ax.draw_artist(collection)
        for arm in arms:
            ax.draw_artist(arm.moved(angles))
        clock.set_text(f"t = {time:5.2f} s of {plan.makespan:.2f} s, {shown}")
        ax.draw_artist(clock)
        yield np.asarray(canvas.buffer_rgba())


class _Moving:
    """The outlines of one body on all positioners, moved in place: their paths look into one array of corners."""

    def __init__(self, ax: Axes, plan: Plan, some: Outlines) -> None:
        self._plane, self._some = plan.problem.plane, some
        colours = [style.OUTCOMES[outcome].light for outcome in plan.outcomes]
        faces = [colours[i] for i in some.positioners] if some.link == "beta" else [style.LINE.light]
        self._corners = np.array(some.placed(self._plane, plan.trajectory.start))
        paths = [Outline(corners) for corners in some.split(self._corners)]
        self._collection = PathCollection(paths, facecolors=faces, edgecolors="none", animated=True, zorder=3)
        self._collection.set_transform(ax.transData)
        ax.add_collection(self._collection, autolim=False)

    def moved(self, angles: np.ndarray) -> Artist:
        """What to draw at `angles` (n, 2) [rad]."""
        self._corners[:] = self._some.placed(self._plane, angles)
        return self._collection


def _told(pictures: Iterator[np.ndarray], count: int, tell: Callable[[int, int], None] | None) -> Iterator[np.ndarray]:
    """The same pictures; `tell` hears of each."""
    for k, picture in enumerate(pictures, 1):
        if tell is not None:
            tell(k, count)
        yield picture


def _as_mp4(pictures: Iterator[np.ndarray], fps: float) -> bytes:
    """An MP4 that browsers and slides play."""
    try:
        import imageio_ffmpeg
    except ImportError:
        raise FiberplanError("an .mp4 needs the extra 'movie': pip install 'fiberplan[movie]'; .gif does not") from None
    first = next(pictures)
    with tempfile.TemporaryDirectory() as folder:
        film = Path(folder) / "film.mp4"
        writer = imageio_ffmpeg.write_frames(
            str(film),
            (first.shape[1], first.shape[0]),
            pix_fmt_in="rgba",
            fps=fps,
            quality=None,
            codec="libx264",
            macro_block_size=2,
            output_params=["-crf", "21", "-preset", "veryfast", "-movflags", "+faststart"],
        )
        writer.send(None)
        try:
            writer.send(np.ascontiguousarray(first))  # before the next is drawn over it
            for picture in pictures:
                writer.send(np.ascontiguousarray(picture))
        finally:
            writer.close()
        return film.read_bytes()


def _as_gif(pictures: Iterator[np.ndarray], fps: float) -> bytes:
    """A GIF that repeats, all in one palette."""
    import io

    from PIL import Image

    palette: Any = None

    def reduced() -> Iterator[Any]:
        nonlocal palette
        for picture in pictures:
            image = Image.fromarray(picture[..., :3])
            if palette is None:
                palette = image.quantize(_MOST_COLOURS, dither=Image.Dither.NONE)
            yield image.quantize(palette=palette, dither=Image.Dither.NONE)

    images = reduced()
    first, film = next(images), io.BytesIO()
    first.save(film, "GIF", save_all=True, append_images=images, duration=round(1000 / fps), loop=0, optimize=False)
    return film.getvalue()
