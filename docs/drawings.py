"""Draw the algorithms of the manual into ``docs/drawings``, as SVG: ``python docs/drawings.py``.

What is drawn is what the library does: clearances, plans, roadmaps and options are computed here, none is sketched.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Annulus, Circle, Ellipse

import fiberplan as fp
from fiberplan.plan import Plan
from fiberplan.planners.prioritized_roadmap.roadmap import cells, middle_edges, paths
from fiberplan.scenes.decisive import pinwheel
from fiberplan.visuals import style
from fiberplan.visuals.canvas import blank, keyed, save, titled
from fiberplan.visuals.figures.arrays import draw_configuration

FOLDER = Path(__file__).parent / "drawings"
INK, MUTED, LINE = style.INK.light, style.MUTED.light, style.LINE.light
OURS, OTHER, SAFE, LAST = style.SERIES[0], style.SERIES[1], style.SERIES[2], style.SERIES[3]


def named(ax: Axes, text: str, at: np.ndarray, by: tuple[float, float] = (0.0, 0.0)) -> None:
    """Words beside a point."""
    ax.annotate(text, at, np.add(at, by), color=INK, fontsize=9, ha="center", va="center")


def bare(ax: Axes, title: str) -> None:
    """Axes in mm to equal scale."""
    ax.set_aspect("equal")
    ax.grid(False)
    ax.margins(0.05)
    titled(ax, title, "x [mm]", "y [mm]")


def arm() -> Axes:
    """One positioner and its words."""
    plane, pose = fp.FocalPlane.hexagonal(0, 22.4), np.radians([[25.0, 70.0]])
    ax = blank((5.6, 5.2))[1][0]
    ax.add_patch(Annulus(plane.base[0], 22.4, 7.6, color=OURS, alpha=0.12, linewidth=0))
    draw_configuration(ax, plane, pose, [fp.Outcome.ARRIVED])
    elbow, fiber = plane.elbows(pose)[0], plane.fibers(pose)[0]
    ax.plot(*plane.base[0], "o", color=INK)
    ax.plot(*elbow, "o", color=INK, markersize=4)
    ax.plot(*fiber, "o", color=OTHER, markersize=5)
    named(ax, "base", plane.base[0], (-3.6, -1.0))
    named(ax, "alpha: the first link", elbow / 2, (5.5, -3.2))
    named(ax, "elbow", elbow, (5.2, 0.0))
    named(ax, "beta: the second link", (elbow + fiber) / 2, (11.5, 1.5))
    named(ax, "fiber", fiber, (-4.4, 1.2))
    named(ax, "patrol zone", np.array([-14.5, -8.0]))
    ax.autoscale_view()
    bare(ax, "A positioner")
    return ax


def overlap() -> Axes:
    """Seven positioners, their patrol zones, and those that touch."""
    plane = fp.FocalPlane.hexagonal(1, 22.4)
    pose = np.array(plane.folded)
    pose[3], pose[4] = np.radians([20.0, 60.0]), np.radians([130.0, 40.0])
    near = {i for k, pair in enumerate(plane.pairs) if plane.clearance(pose)[k] < 0.8 for i in pair}
    ax = blank((6.0, 5.6))[1][0]
    for base in plane.base:
        ax.add_patch(Circle(base, 22.4, facecolor=OURS, alpha=0.08, edgecolor="none"))
    outcomes = [fp.Outcome.DEADLOCKED if i in near else fp.Outcome.ARRIVED for i in range(plane.n)]
    draw_configuration(ax, plane, pose, outcomes)
    ax.plot(*plane.base.T, "o", color=INK, markersize=3)
    ax.autoscale_view()
    bare(ax, "Patrol zones overlap: two arms are nearer than the margin")
    return ax


def proof() -> Axes:
    """The clearance of the pair that comes nearest, and what each look vouches for."""
    plan = field_to_field(1)
    plane, motion, margin = plan.problem.plane, plan.trajectory, plan.problem.margin
    pair = plan.certificate.pairs[np.argmin(plan.certificate.clearance)]
    times = np.linspace(0.0, plan.makespan, 900)
    both = np.ascontiguousarray(pair[None])
    gaps = np.array([plane.clearance(motion.at(float(t)), both)[0] for t in times])
    speed = 2.0 * np.max(np.abs(np.diff(gaps) / np.diff(times)))  # a bound, with room
    ax = blank((7.2, 3.8))[1][0]
    todo = [(0.0, plan.makespan)]
    while todo:
        begin, end = todo.pop()
        middle = (begin + end) / 2.0
        gap = float(np.interp(middle, times, gaps))
        half = max(gap - margin, 0.0) / speed
        ax.plot([middle - half, middle, middle + half], [margin, gap, margin], color=SAFE, linewidth=0.8)
        if half < (end - begin) / 2.0:
            todo += [(begin, middle - half), (middle + half, end)]
    ax.plot(times, gaps, color=OURS, linewidth=2.0, label="clearance")
    ax.plot([], [], color=SAFE, linewidth=0.8, label="a look, and how long it vouches")
    ax.axhline(margin, color=style.CONTACT.light, linestyle="--", linewidth=1.0, label="margin")
    ax.set_xlim(0.0, plan.makespan)
    ax.set_ylim(0.0, None)
    titled(ax, f"{plane.ids[pair[0]]} and {plane.ids[pair[1]]}: looks until the whole motion is covered", "time [s]",
           "clearance [mm]")  # fmt: skip
    keyed(ax, loc="upper right", bbox_to_anchor=(1.0, 1.0))
    return ax


def field_to_field(rings: int) -> Plan:
    """From one random field to another."""
    plane = fp.FocalPlane.hexagonal(rings, 22.4)
    start, goal = (fp.scenes.uniform_field(plane, seed, 0.8) for seed in (1, 2))
    return fp.planners.Direct().plan(fp.Problem(plane, start, goal, margin=0.8))


def direct() -> Axes:
    """Three that block each other, straight and as planned, at four moments."""
    problem = pinwheel()
    plane, plan = problem.plane, fp.planners.Direct().plan(problem)
    seconds = float(np.max(np.abs(problem.goal - problem.start) / plane.max_speed))
    straight = fp.Trajectory.from_samples([0.0, seconds], [problem.start, problem.goal])
    axes = blank((7.2, 4.2), rows=2, columns=4)[1]
    for row, (motion, what) in enumerate(((straight, "straight"), (plan.trajectory, "planned"))):
        for ax, t in zip(axes[4 * row :], np.linspace(0.0, motion.duration, 4), strict=False):
            angles = motion.at(float(t))
            bad = plane.clearance(angles) < 0.0
            touching = set(plane.pairs[bad].ravel().tolist())
            outcomes = [fp.Outcome.DEADLOCKED if i in touching else fp.Outcome.ARRIVED for i in range(plane.n)]
            draw_configuration(ax, plane, angles, outcomes)
            ax.set(xlim=(-30, 30), ylim=(-30, 30), xticks=[], yticks=[])
            titled(ax, f"{what}, {t:.1f} s", "", "")
    return axes[0]


def greedy_fold() -> Axes:
    """A fold, from a field to folded."""
    plane = fp.FocalPlane.hexagonal(2, 22.4)
    start = fp.scenes.uniform_field(plane, 1, 0.8)
    plan = fp.planners.GreedyFold(step=np.radians(1.0)).plan(fp.Problem(plane, start, plane.folded, margin=0.8))
    return fp.visuals.snapshots(plan)[0]


def navigation() -> Axes:
    """The potential of Makarem2014 for one fiber, its neighbour in the way."""
    D, d, lambda1, lambda2 = 4.0, 2.0, 1.0, 4.0
    x, y = np.meshgrid(np.linspace(-8.0, 8.0, 240), np.linspace(-6.0, 6.0, 180))
    goal, other = np.array([5.0, 0.5]), np.array([0.0, 0.0])
    apart = np.hypot(x - other[0], y - other[1])
    with np.errstate(divide="ignore", invalid="ignore"):
        push = np.where(apart > d, np.maximum(0.0, (D**2 - apart**2) / (apart**2 - d**2)), np.nan)
    psi = lambda1 * ((x - goal[0]) ** 2 + (y - goal[1]) ** 2) + lambda2 * push
    ax = blank((6.4, 4.6))[1][0]
    ax.contour(x, y, psi, levels=np.linspace(2.0, 160.0, 20), colors=[OURS], linewidths=0.8)
    ax.add_patch(Circle(other, d, color=style.CONTACT.light, alpha=0.25))
    ax.add_patch(Circle(other, D, fill=False, color=MUTED, linestyle="--"))
    ax.plot(*goal, "*", color=SAFE, markersize=14)
    named(ax, "neighbour", other)
    named(ax, "d", np.array([0.0, -1.6]))
    named(ax, "D", np.array([0.0, -4.4]))
    named(ax, "target", goal, (0.0, -1.2))
    bare(ax, "The potential that a fiber descends")
    return ax


def elliptic() -> Axes:
    """An arm of MOONS: bodies at their heights, and the ellipses of Makarem2016."""
    plane = fp.FocalPlane.load("moons").subset(np.arange(1), np.array([], np.int64))
    ax = blank((6.4, 4.2))[1][0]
    draw_configuration(ax, plane, np.radians([[0.0, 0.0]]), [fp.Outcome.NO_TARGET])
    elbow, fiber = plane.elbows(np.zeros((1, 2)))[0], plane.fibers(np.zeros((1, 2)))[0]
    turn = float(np.degrees(np.arctan2(*(fiber - elbow)[::-1])))
    for part, colour, name in ((0.8, OURS, "tip"), (0.3, OTHER, "neck")):
        middle = elbow + part * (fiber - elbow)
        ax.add_patch(Ellipse(middle, 9.0, 4.4, angle=turn, facecolor=colour, alpha=0.45, edgecolor=colour, zorder=5))
        named(ax, name, middle)
    ax.plot(*fiber, "o", color=INK, markersize=4)
    bare(ax, "Zones at two heights: each meets its like only")
    return ax


def roadmap() -> Axes:
    """The joint space of one probe arm, and the three quickest paths of one to three edges."""
    plane = fp.FocalPlane.load("miradas")
    points = cells(plane, 0, (8, 6))
    pairs = middle_edges(len(points), 12, np.random.default_rng(2))
    start, goal = np.asarray(plane.folded[0]), np.asarray(points[len(points) // 2] + 0.15)
    ax = blank((6.4, 4.8))[1][0]
    ax.plot(*np.degrees(points).T, ".", color=MUTED, label="grid, outside the zone of avoidance")
    for k, pair in enumerate(pairs):
        label = {"label": "middle edges"} if k == 0 else {}
        ax.plot(*np.degrees(points[pair]).T, color=MUTED, linewidth=0.9, **label)
    found = paths(plane, 0, start, goal, points, pairs, 6.0, 20)
    for edges, colour in ((1, OURS), (2, OTHER), (3, LAST)):
        path = next((path for path in found if path.through == edges - 1), None)
        if path is not None:
            said = f"{edges} edge{'s' if edges > 1 else ''}: {path.estimate:.0f} s"
            ax.plot(*np.degrees(path.configurations).T, "-", color=colour, linewidth=2.0, label=said)
    for at, name in ((start, "start"), (goal, "goal")):
        ax.plot(*np.degrees(at), "o", color=INK)
        named(ax, name, np.degrees(at), (0.0, 14.0))
    titled(ax, f"Paths of one arm, {len(found)} in all", "theta1 [deg]", "theta2 [deg]")
    keyed(ax, loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=2)
    return ax


def four_bar() -> Axes:
    """A probe arm of MIRADAS, with the joints' names."""
    plane = fp.FocalPlane.load("miradas").subset(np.arange(1), np.array([], np.int64))
    pose = np.radians([[60.0, 120.0]])
    (crank,), (rocker,) = plane.kinematics.skeleton(plane, pose)
    fiber = plane.fibers(pose)[0]
    ax = blank((6.4, 4.8))[1][0]
    ax.plot(*crank.T, color=OURS, linewidth=3, label="first crank, d13")
    ax.plot(*rocker.T, color=OTHER, linewidth=3, label="second crank, d24")
    ax.plot(*np.stack([crank[1], fiber]).T, color=SAFE, linewidth=3, label="probe")
    ax.plot(*np.stack([crank[1], rocker[1]]).T, color=INK, linewidth=1.2, linestyle=":", label="slider, d34")
    for at, name in ((crank[0], "J1"), (rocker[0], "J2"), (crank[1], "J3"), (rocker[1], "J4"), (fiber, "tip")):
        ax.plot(*at, "o", color=INK, markersize=4)
        ax.annotate(name, at, xytext=(6, 6), textcoords="offset points", color=INK, fontsize=9)
    bare(ax, "A four-bar arm: J1 and J2 are driven")
    keyed(ax, loc="lower left", bbox_to_anchor=(0.0, 1.1), ncols=4)
    return ax


def allocation() -> Axes:
    """Three positioners, five targets, every option, and which of them touch."""
    plane = fp.FocalPlane.hexagonal(1, 22.4).subset(np.array([2, 3, 4]), np.array([], np.int64))
    rng = np.random.default_rng(3)
    places = np.stack([rng.uniform(-28.0, 28.0, 10), rng.uniform(-14.0, 14.0, 10)], axis=1)
    table = fp.survey.conflicts(plane, fp.Targets(*places.T), margin=0.8)
    options = table.options
    fibers, who = places[options.target], options.positioner
    ax = blank((7.0, 4.4))[1][0]
    spread = np.stack([np.arange(len(who)) % 3 - 1.0, np.arange(len(who)) % 2 - 0.5], axis=1) * 1.1
    at = fibers + spread
    for a, b in zip(*table.nonzero(), strict=True):
        if a < b:
            label = {"label": "touch at rest"} if not ax.get_lines() else {}
            ax.plot(*at[[a, b]].T, color=style.CONTACT.light, linewidth=0.9, **label)
    for i in range(plane.n):
        ax.plot(*at[who == i].T, "o", color=(OURS, OTHER, LAST)[i], label=f"options of {plane.ids[i]}")
        ax.plot(*plane.base[i], "s", color=(OURS, OTHER, LAST)[i], markersize=8)
    ax.plot(*places.T, "+", color=INK, markersize=10, label="targets")
    bare(ax, "Options, and which of them exclude each other")
    keyed(ax, loc="upper center", bbox_to_anchor=(0.5, -0.18), ncols=3)
    return ax


DRAWINGS: tuple[Callable[[], Axes], ...] = (
    arm, overlap, proof, direct, greedy_fold, navigation, elliptic, roadmap, four_bar, allocation
)  # fmt: skip

if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for drawing in DRAWINGS:
        save(drawing().figure, FOLDER / f"{drawing.__name__.replace('_', '-')}.svg")
