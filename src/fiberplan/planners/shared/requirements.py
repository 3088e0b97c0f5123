"""What planners refuse to plan, in one line: arms of other kinds, and steps that rounding would spoil."""

import numpy as np

from fiberplan.errors import ProblemError
from fiberplan.focal_plane import FocalPlane
from fiberplan.problem import Problem
from fiberplan.tolerances import SPEED


def require_two_links(planner: str, plane: FocalPlane) -> None:
    """Refuse four-bar arms.

    Raises:
        ProblemError: the focal plane has them.
    """
    if plane.four_bar is not None:
        raise ProblemError(
            f"planner {planner} cannot plan the four-bar arms of {plane.name}: take --planner prioritized-roadmap"
        )


def require_exact_steps(planner: str, problem: Problem, dt: float) -> None:
    """Refuse steps of `dt` [s] in which a joint turns so little that rounding its angle would exceed its speed limit.

    Raises:
        ProblemError: there is such a joint of a positioner that can move.
    """
    plane = problem.plane
    angle = np.fmax(np.fmax(np.abs(problem.start), np.abs(problem.goal)), 2.0 * np.pi)
    least = np.spacing(angle) / SPEED
    short = np.argwhere((plane.max_speed * dt < least) & plane.online[:, None])
    if len(short):
        i, joint = map(int, short[0])
        name, turn = ("alpha", "beta")[joint], plane.max_speed[i, joint] * dt
        raise ProblemError(
            f"{planner}: dt {dt:g} s is so short that {name} of positioner '{plane.ids[i]}' turns by {turn:.3g} rad in "
            f"a step, and rounding its angle needs {least[i, joint]:.3g} rad: take a longer dt",
            (i,),
        )
