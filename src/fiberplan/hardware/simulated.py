"""What robots make of a motion when clocks, motors and the line to them are not perfect.

Each robot starts a little late, by a clock of its own that runs a little fast or slow; its joints are off by a little
at each knot, and stop at whole steps. Some robots stall on the way, some never start, and an abort reaches each after
its own latency. What comes of it is a motion like any other, so `verify` says who touched whom and when, and
`state_after` is where the next plan starts. The same seed gives the same motion. What a contact does to the two that
touch is not simulated: they pass through each other.
"""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from fiberplan.arrays import Frozen, FrozenDict, in_units
from fiberplan.certificates import Certificate, verify
from fiberplan.errors import TrajectoryError
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.drift import motion_bounds
from fiberplan.motion import Executed, Trajectory
from fiberplan.problem import State
from fiberplan.shaping.knots import angles_at

_ANY_SPEED = 1e9  # [rad/s] no joint is faster


@dataclass(frozen=True)
class Faults(Frozen):
    """What goes wrong; each robot draws its own within these.

    Raises:
        TrajectoryError: a value that is negative or not finite, or a drift of 1 or more.
    """

    latency: float = 0.0  #: robots start, and stop at an abort, up to so late [s]
    drift: float = 0.0  #: clocks are fast or slow by up to this part
    tracking: float = 0.0  #: joints are off by up to this at knots [rad]
    step: float = 0.0  #: joints stop at whole multiples of this, from where they start [rad]
    stalls: Mapping[int, float] = field(default_factory=dict)  #: robot -> when it stops for good, by its clock [s]
    absent: tuple[int, ...] = ()  #: robots that never start
    abort: float = np.inf  #: everyone is told to stop then [s]
    any_stall: int = 0  #: so many more robots stall, at any moment; of those that turn, drawn for each seed
    any_absent: int = 0  #: so many more robots never start, drawn likewise
    name = "simulate"

    def __post_init__(self) -> None:
        in_units(self, {"latency": "s", "drift": "", "tracking": "rad", "step": "rad", "abort": "s"}, TrajectoryError)
        object.__setattr__(self, "stalls", FrozenDict({int(i): float(t) for i, t in self.stalls.items()}))
        object.__setattr__(self, "absent", tuple(int(i) for i in self.absent))
        for what in ("latency", "drift", "tracking", "step"):
            if not 0 <= getattr(self, what) < (1.0 if what == "drift" else np.inf):
                raise TrajectoryError(f"simulate: {what} {getattr(self, what):g} makes no sense")
        if not all(t >= 0 for t in (self.abort, *self.stalls.values())):
            raise TrajectoryError("simulate: robots stall and motions are aborted at 0 s or later")
        if not (self.any_stall >= 0 and self.any_absent >= 0):
            raise TrajectoryError("simulate: fewer than no robots cannot stall or be absent")

    @property
    def stops_some(self) -> bool:
        """Whether somebody stalls or never starts, so that others meet it where it should not be."""
        return bool(self.stalls or self.absent or self.any_stall or self.any_absent)

    def jitter(self, duration: float) -> float:
        """How far any clock is off in a motion of so many seconds [s]: what `verify` has to allow for."""
        return self.latency + self.drift * (duration + self.latency)

    def drawn(self, trajectory: Trajectory, seed: int) -> "Faults":
        """The same with `any_stall` and `any_absent` robots named; as many as there are, if fewer turn."""
        if not (self.any_stall or self.any_absent):
            return self
        turns = np.unique(trajectory.owner[(trajectory.angles != trajectory.start[trajectory.owner]).any(axis=1)])
        rng = np.random.default_rng([seed, 1])
        who = rng.permutation(np.setdiff1d(turns, [*self.stalls, *self.absent]))
        moments = rng.uniform(0.0, trajectory.duration, len(who))
        named, rest = who[: self.any_stall], who[self.any_stall :]
        stalls = dict(self.stalls) | dict(zip(named.tolist(), moments.tolist(), strict=False))
        absent = (*self.absent, *rest[: self.any_absent].tolist())
        return dataclasses.replace(self, stalls=stalls, absent=absent, any_stall=0, any_absent=0)

    def position_error(self, plane: FocalPlane) -> np.ndarray:
        """(n,) how far any arm is off [mm]: what `verify` has to allow for."""
        return motion_bounds(plane, np.full((plane.n, 2), self.tracking + 0.5 * self.step))


def proof_within(plane: FocalPlane, executed: Executed, faults: Faults, margin: float = 0.0) -> Certificate:
    """Proof of a motion with all clocks and joints off by as much as the faults have it: no run of it finds a contact.

    It says nothing of runs in which somebody stalls or never starts, nor of speeds, which audits judge.
    """
    told = dataclasses.replace(executed, clock_error=0.0)
    fast = plane.replace(max_speed=np.full((plane.n, 2), _ANY_SPEED), min_speed=None, max_acceleration=None)
    jitter, error = faults.jitter(executed.trajectory.duration), faults.position_error(plane)
    return verify(fast, told, margin, jitter, error)


def simulated(trajectory: Trajectory, faults: Faults, seed: int = 0) -> Trajectory:
    """The motion that robots make of one.

    Args:
        trajectory: what they are told.
        faults: what goes wrong.
        seed: of what each robot draws.

    Raises:
        TrajectoryError: a fault of a robot that is not there.
    """
    n, faults = trajectory.n, faults.drawn(trajectory, seed)
    for i in (*faults.stalls, *faults.absent):
        if not 0 <= i < n:
            raise TrajectoryError(f"simulate: there is no positioner {i} among {n}")
    rng = np.random.default_rng(seed)
    late, told = rng.uniform(0.0, faults.latency, n), rng.uniform(0.0, faults.latency, n)
    rate = 1.0 + rng.uniform(-faults.drift, faults.drift, n)
    owner = trajectory.owner
    angles = trajectory.angles + rng.uniform(-faults.tracking, faults.tracking, trajectory.angles.shape)
    angles[trajectory.offsets[:-1]] = trajectory.start
    if faults.step > 0:
        angles = trajectory.start[owner] + np.rint((angles - trajectory.start[owner]) / faults.step) * faults.step
    rests = np.append(True, (np.diff(trajectory.angles, axis=0) == 0).all(axis=1) & (owner[1:] == owner[:-1]))
    for k in np.flatnonzero(rests[1:]) + 1:  # who rests stays where it has come to
        angles[k] = angles[k - 1]
    executed = Trajectory.from_knots(
        np.concatenate([np.arange(n), owner]),
        np.concatenate([np.zeros(n), late[owner] + trajectory.times * rate[owner]]),
        np.concatenate([trajectory.start, angles]),
        n,
    )
    stops = np.full(n, faults.abort) + told
    for i, when in faults.stalls.items():
        stops[i] = min(stops[i], late[i] + when * rate[i])
    stops[list(faults.absent)] = 0.0
    return _stopped(executed, stops)


def as_told(state: State, executed: Executed) -> State:
    """The state before a motion, with what its file says of it: who stands there, and who cannot move."""
    placed = executed.placed
    online = state.online & (executed.online | ~placed)
    return dataclasses.replace(state, online=online, unknown=state.unknown & ~placed)


def state_after(plane: FocalPlane, executed: Trajectory, faults: Faults, before: State | None = None) -> State:
    """Where everyone stands after a simulated motion: who stalled or never started cannot move any more.

    Args:
        plane: whose robots they are.
        executed: what they did.
        faults: what went wrong, `Faults.drawn` if robots were drawn.
        before: who cannot move anyway, how well places are known, and whose place is a guess.
    """
    before = State(executed.start, plane.online) if before is None else before
    online, unknown = plane.online & before.online, before.unknown & (executed.end == executed.start).all(axis=1)
    state = dataclasses.replace(before, angles=executed.end, online=online, unknown=unknown, source="simulated motion")
    dead = sorted({*faults.stalls, *faults.absent})
    return state.without(plane, dead, "it stalled or never started") if dead else state


def _stopped(motion: Trajectory, stops: np.ndarray) -> Trajectory:
    """The motion, each robot's only until it stops (n,) [s]."""
    n, owner = motion.n, motion.owner
    cut = np.flatnonzero(stops < motion.times[motion.offsets[1:] - 1])
    kept = motion.times <= stops[owner]
    return Trajectory.from_knots(
        np.concatenate([owner[kept], cut]),
        np.concatenate([motion.times[kept], stops[cut]]),
        np.concatenate([motion.angles[kept], angles_at(motion, cut, stops[cut])]),
        n,
    )
