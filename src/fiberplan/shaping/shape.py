"""A motion made fit for motors that cannot jump, and proven anew.

First the corners of all paths are rounded by ramps (`ramps`), then joints that would turn too slowly turn and rest
instead (`bursts`), and the result is given to `verify`. Where that finds pairs too near, their joints follow the given
motion more closely, as far as that helps. The pairs that are left need more room in the plan: `replanned` asks a
planner for it.
"""

from dataclasses import dataclass

import numpy as np

from fiberplan.arrays import Frozen, number, read_only
from fiberplan.certificates import Certificate, verify
from fiberplan.errors import TrajectoryError
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.drift import motion_bounds
from fiberplan.motion import Trajectory
from fiberplan.shaping.bursts import no_slower
from fiberplan.shaping.ramps import ramped
from fiberplan.shaping.whole_steps import in_whole_steps
from fiberplan.tolerances import RAMP

_FOLLOW = np.radians([6.0, 1.5, 0.4, 0.1])  # how far a joint may be off where its motor is too fast, in turn


@dataclass(frozen=True, eq=False)
class Shaped(Frozen):
    """What a motion became, and what it costs."""

    trajectory: Trajectory  #: obeys ranges, speeds, accelerations and least speeds
    certificate: Certificate  #: of it, at the margin that was asked for
    error: np.ndarray  #: (n, 2) how far joints leave its straight pieces on their true ramps, at most [rad]
    longer: float  #: than the given motion [s]
    steps: np.ndarray | None = None  #: (segments, n, 2) of each motor in each segment, where their length was given

    @property
    def lacking(self) -> dict[tuple[int, int], float]:
        """Pairs that are not proven to keep the margin, and what they lack [mm]; obstacle k is -1 - k."""
        proof = self.certificate
        return {each.pair: max(0.0, proof.margin - each.clearance) for each in (*proof.contacts, *proof.undecided)}

    def __repr__(self) -> str:
        return f"<Shaped: {self}>"

    def __str__(self) -> str:
        return f"{self.longer:.3f} s longer; {self.certificate}"


def shape(
    trajectory: Trajectory,
    plane: FocalPlane,
    margin: float = 0.0,
    position_error: float | np.ndarray = 0.0,
    opening: bool = False,
    allowance: float = 0.025,
    segment: float | None = None,
    step: np.ndarray | None = None,
    jitter: float = 0.0,
) -> Shaped:
    """The motion as motors with `max_acceleration` and `min_speed` can make it.

    Args:
        trajectory: a motion within ranges and speeds, safe at `margin`.
        plane: whose motors move.
        margin: clearance to keep [mm].
        position_error: as `verify` takes it [mm].
        opening: as `verify` takes it.
        allowance: what straight pieces may leave out of the true ramps, at any point of an arm [mm].
        segment: in segments of this length [s], in which speeds are even ...
        step: ... and all turns whole multiples of this: (2,) or (n, 2) [rad].
        jitter: as `verify` takes it [s].

    Raises:
        TrajectoryError: another number of positioners than the focal plane has, an allowance, segment or step that is
            not positive, one of the last two alone, or steps in which a joint cannot get where it should.
    """
    allowance = number(allowance, "mm", "shape: allowance", TrajectoryError)
    if trajectory.n != plane.n:
        raise TrajectoryError(f"shape: the motion has {trajectory.n} positioners, the focal plane {plane.n}")
    if not 0 < allowance < np.inf:
        raise TrajectoryError(f"shape: allowance must be a positive length, got {allowance:g}")
    left_out = np.minimum(RAMP, allowance / motion_bounds(plane, np.ones((plane.n, 2))))
    whole = None if segment is None and step is None else _whole(plane, segment, step)
    ramps = ramped(trajectory, plane, left_out)
    level, certificate = np.zeros(plane.n, np.int64), None
    while True:
        steps = None
        if whole is None:
            made = no_slower(ramps.trajectory, plane, _FOLLOW[level])
        else:
            made, steps = in_whole_steps(ramps.trajectory, plane, *whole, _FOLLOW[level])
        certificate = verify(plane, made, margin, jitter, position_error, opening, known=certificate)
        shaped = Shaped(made, certificate, read_only(ramps.error), made.duration - trajectory.duration, steps)
        near = np.unique([arm for pair in shaped.lacking for arm in pair if arm >= 0]).astype(np.int64)
        near = near[level[near] < len(_FOLLOW) - 1]
        if plane.min_speed is None or not len(near):
            return shaped
        level[near] += 1


def _whole(plane: FocalPlane, segment: float | None, step: np.ndarray | None) -> tuple[np.ndarray, float]:
    """The turn of one step (n, 2) [rad], and the length of a segment [s]."""
    if segment is None or step is None:
        raise TrajectoryError("shape: whole steps need both a segment and a step")
    seconds = number(segment, "s", "shape: segment", TrajectoryError)
    turn = read_only(step, unit="rad", name="shape: step", error=TrajectoryError)
    if turn.shape not in ((2,), (plane.n, 2)) or not (np.isfinite(turn) & (turn > 0)).all():
        raise TrajectoryError(f"shape: step must be positive angles of shape (2,) or ({plane.n}, 2)")
    if not 0 < seconds < np.inf:
        raise TrajectoryError(f"shape: segment must be a positive time, got {seconds:g}")
    return np.broadcast_to(turn, (plane.n, 2)), seconds
