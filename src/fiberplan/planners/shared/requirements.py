"""For planners that know arms of two links only."""

from fiberplan.errors import ProblemError
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.two_link import TwoLink


def refuse_bars(planner: str, plane: FocalPlane) -> None:
    """Refuse four-bar arms.

    Raises:
        ProblemError: the focal plane has them.
    """
    if not isinstance(plane.kinematics, TwoLink):
        raise ProblemError(
            f"planner {planner} cannot plan the {plane.kinematics.name} arms of {plane.name}: "
            "take --planner prioritized-roadmap"
        )
