"""What planners ask of their settings and of the problem, in the same words."""

from fiberplan.errors import ProblemError
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.two_link import TwoLink
from fiberplan.plan.seeds import seed_complaint


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
