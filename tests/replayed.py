"""Plan files for tests of the replay, of two or three arms whose motions are written down: nobody searches for them."""

import numpy as np

import fiberplan as fp
from fiberplan.focal_plane.bodies import Obstacle
from fiberplan.io.plan_file import plan_bytes
from fiberplan.scenes.decisive import row
from problems import four_bars, several_heights
from references import motion_of


def made(plane, knots, margin, **settings):
    """The content of a file: knots (time, alpha, beta) [s, deg] of each arm, which arrives if it can move."""
    motion = motion_of(*([(t, *np.radians(angles)) for t, *angles in own] for own in knots))
    goal = np.where(plane.online[:, None], motion.end, np.nan)
    problem = fp.Problem(plane, motion.start, goal, margin, **settings)
    outcomes = tuple(fp.Outcome.ARRIVED if online else fp.Outcome.OFFLINE for online in plane.online)
    return plan_bytes(fp.Plan(problem, motion, outcomes, "direct"))


def three():
    """Two turn past each other, the third cannot move, and a post stands by: no one axis parts them all the time."""
    plane = row(3).replace(obstacles=(Obstacle("post", [[22.4, 24.0]], 1.5),), online=np.arange(3) < 2)
    first, second = [(0, 280, 20), (12, 140, 80), (24, 210, 80)], [(0, 70, 70), (12, 200, 90), (24, 100, 60)]
    return made(plane, [first, second, [(0, 0, 180)]], 0.5)


def heights():
    """Bodies at two heights, and a post that only the lower ones meet."""
    plane = several_heights().plane.subset([9, 10])
    return made(plane, [[(0, 0, 170), (12, 40, 120)], [(0, 60, 150), (12, 90, 100)]], 0.1)


def concave():
    """Two DESI robots, whose outlines are not convex, in a corner."""
    plane = fp.FocalPlane.load("desi")
    near = np.argsort(np.hypot(*(plane.base - plane.base.mean(axis=0)).T))[:2]
    plane = plane.subset(np.sort(near))
    x, y = plane.base.min(axis=0) - 9.0
    corner = [[x, y], [x + 30.0, y], [x + 30.0, y + 1.0], [x + 1.0, y + 1.0], [x + 1.0, y + 30.0], [x, y + 30.0]]
    plane = plane.replace(obstacles=(Obstacle("corner", corner, closed=True, category="phi"),))
    folded = np.degrees(plane.folded)
    return made(
        plane, [[(0, *at), (12, *(at + turn))] for at, turn in zip(folded, ([30, -9], [-20, -5]), strict=True)], 0.05
    )


def opening():
    """Two begin nearer than the margin, and part."""
    first, second = [(0, 0, 29.9), (12, 60, 90)], [(0, 180, 29.9), (12, 240, 90)]
    return made(row(2), [first, second], 1.0, near_start="open")


def four_bar():
    """Two of MIRADAS' arms."""
    problem = four_bars()
    start = np.degrees(problem.start)
    return made(problem.plane.subset([0, 1]), [[(0, *at), (60, *(at + 8.0))] for at in start[:2]], 0.5)


FILES = {"three": three, "heights": heights, "concave": concave, "opening": opening, "four-bar": four_bar}
