"""What motors do with what they are sent: a motion, and how far off joints and clocks may be from it.

A controller rounds angles and times, accelerates where a trajectory turns at once, and starts a little late. Whatever
cannot be written into the trajectory is bounded here, so that a proof can leave room for it.
"""

from dataclasses import dataclass

import numpy as np

from fiberplan.arrays import Frozen, number, read_only
from fiberplan.errors import TrajectoryError
from fiberplan.motion.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class Executed(Frozen):
    """A motion as it is executed.

    Raises:
        TrajectoryError: shapes that do not fit, or errors that are negative or not finite.
    """

    trajectory: Trajectory
    joint_error: np.ndarray  #: (n, 2) each joint may be off by this at any time [rad]
    clock_error: float  #: each positioner's clock may be off by this [s]
    notes: tuple[str, ...] = ()  #: what is worth knowing of the file, one sentence each
    assumptions: tuple[str, ...] = ()  #: what is taken to be so without the file saying it
    online: np.ndarray = None  # type: ignore[assignment]
    """(n,) False: the file does not move it, or it cannot move; all True unless given."""
    placed: np.ndarray = None  # type: ignore[assignment]
    """(n,) True: the file says where it is, and `online` whether it can move; as `online` unless given."""

    def __post_init__(self) -> None:
        n = self.trajectory.n
        clock = number(self.clock_error, "s", "clock error", TrajectoryError)
        object.__setattr__(self, "clock_error", clock)
        error = read_only(self.joint_error, unit="rad", name="joint error", error=TrajectoryError)
        online = read_only(np.ones(n, bool) if self.online is None else self.online, bool)
        placed = read_only(online if self.placed is None else self.placed, bool)
        if error.shape != (n, 2) or online.shape != (n,) or placed.shape != (n,):
            raise TrajectoryError(
                f"{n} positioners need joint errors of shape ({n}, 2) and flags of ({n},), got {error.shape}, "
                f"{online.shape} and {placed.shape}"
            )
        if not (np.isfinite([clock, *error.flat]).all() and clock >= 0 and (error >= 0).all()):
            raise TrajectoryError("joint and clock errors must be finite and 0 or more")
        object.__setattr__(self, "joint_error", error)
        object.__setattr__(self, "online", online)
        object.__setattr__(self, "placed", placed)
        object.__setattr__(self, "notes", tuple(self.notes))
        object.__setattr__(self, "assumptions", tuple(self.assumptions))

    @classmethod
    def exactly(cls, trajectory: Trajectory) -> "Executed":
        """A motion that is executed as it is."""
        return cls(trajectory, np.zeros((trajectory.n, 2)), 0.0)

    def __repr__(self) -> str:
        worst = np.degrees(self.joint_error.max(initial=0.0))
        return f"<Executed: {self.trajectory!r}, joints to {worst:.3g} deg, clocks to {self.clock_error:g} s>"
