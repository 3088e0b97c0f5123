"""What planners ask of their settings and of the problem, in the same words."""

import numpy as np

from fiberplan.arrays.seeds import seed_complaint
from fiberplan.errors import ProblemError
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.two_link import TwoLink
from fiberplan.problem import Problem
from fiberplan.tolerances import SPEED


def require_two_links(planner: str, plane: FocalPlane) -> None:
    """Refuse four-bar arms.

    Raises:
        ProblemError: the focal plane has them.
    """
    if not isinstance(plane.kinematics, TwoLink):
        raise ProblemError(
            f"planner {planner} cannot plan the {plane.kinematics.name} arms of {plane.name}: "
            "take --planner prioritized-roadmap"
        )


def refuse_seed(planner: str, seed: int) -> None:
    """Refuse a seed that no generator takes.

    Raises:
        ProblemError: it is no whole number, negative or too large.
    """
    if complaint := seed_complaint(seed):
        raise ProblemError(f"{planner}: {complaint}")


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
