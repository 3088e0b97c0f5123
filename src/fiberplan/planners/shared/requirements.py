"""For planners that know arms of two links only."""

from fiberplan.errors import ProblemError
from fiberplan.focal_plane import FocalPlane


def require_two_links(planner: str, plane: FocalPlane) -> None:
    """Refuse four-bar arms.

    Raises:
        ProblemError: the focal plane has them.
    """
    if plane.four_bar is not None:
        raise ProblemError(
            f"planner {planner} cannot plan the four-bar arms of {plane.name}: take --planner prioritized-roadmap"
        )
