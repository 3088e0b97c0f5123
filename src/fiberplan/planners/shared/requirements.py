"""What planners ask of their settings and of the problem, in the same words."""

from fiberplan.errors import ProblemError
from fiberplan.focal_plane import FocalPlane
from fiberplan.plan.seeds import seed_complaint


def refuse_bars(planner: str, plane: FocalPlane) -> None:
    """Refuse four-bar arms.

    Raises:
        ProblemError: the focal plane has them.
    """
    if plane.four_bar is not None:
        raise ProblemError(
            f"planner {planner} cannot plan the four-bar arms of {plane.name}: take --planner prioritized-roadmap"
        )


def refuse_seed(planner: str, seed: int) -> None:
    """Refuse a seed that no generator takes.

    Raises:
        ProblemError: it is no whole number, negative or too large.
    """
    if complaint := seed_complaint(seed):
        raise ProblemError(f"{planner}: {complaint}")
