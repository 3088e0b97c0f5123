"""Proof that a motion is safe: continuous in time, for every pair that could ever meet, by bisection.

`verify` sees a focal plane and a trajectory from anywhere. It trusts no one's pair list and no planner's word. Three
answers for each pair: proven safe, in contact, undecided; the last counts as unsafe.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from fiberplan.arrays import LARGEST, Frozen, number, read_only
from fiberplan.certificates.bisection import judge
from fiberplan.certificates.clocks import judge_clocks
from fiberplan.certificates.known import taken_over
from fiberplan.certificates.opening import Opening, judge_opening
from fiberplan.certificates.path import Motion, as_motion, rounding, zone_entries
from fiberplan.certificates.reactions import EVERYONE
from fiberplan.certificates.tolerated import Subject, Tolerated, tolerated
from fiberplan.certificates.violations import violations
from fiberplan.errors import TrajectoryError
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.drift import motion_bounds
from fiberplan.focal_plane.geometry import Geometry, geometry_of
from fiberplan.motion import Executed, Trajectory
from fiberplan.registry import notebook_function
from fiberplan.tolerances import OPENING

TOLERANCE = 0.01  #: proven clearance is within this of the true smallest [mm] ...
CAP = 2.0  #: ... for pairs that come within this of the margin [mm]; for others it is only known to be larger


@dataclass(frozen=True)
class Contact:
    """Two that come closer than the margin, or that could not be shown not to."""

    pair: tuple[int, int]  #: positioners; -1 - k is obstacle k
    time: float  #: of first crossing [s]
    clearance: float  #: smallest seen [mm], less what jitter and position errors can take


@dataclass(frozen=True)
class ZoneEntry:
    """A four-bar arm that enters its zone of avoidance, or could not be shown to stay out of it."""

    positioner: int
    time: float  #: from which it was not shown to stay out [s]
    slider: float  #: its length then [mm]


@dataclass(frozen=True, eq=False)
class Certificate(Frozen):
    """What could be proven of a motion. Clearances are less what jitter and position errors can take."""

    margin: float  #: [mm]
    jitter: float  #: clock error allowed for [s]
    position_error: float  #: largest allowed for [mm]
    pairs: np.ndarray  #: (m, 2) neighbour pairs looked at: all that could come within the margin
    clearance: np.ndarray  #: (m,) proven lower bound of each pair's clearance over the whole motion [mm]
    obstacle_pairs: np.ndarray  #: (k, 2) positioner, obstacle number
    obstacle_clearance: np.ndarray  #: (k,) [mm]
    contacts: tuple[Contact, ...] = ()  #: proven contacts, one per pair, by time
    undecided: tuple[Contact, ...] = ()  #: pairs neither shown safe nor shown to touch; they count as unsafe
    violations: tuple[str, ...] = ()  #: ranges, speeds, accelerations, offline positioners that move
    resting: tuple[Contact, ...] = field(default=())  #: contacts of two that cannot move: reported, not a failure
    zones: tuple[ZoneEntry, ...] = ()  #: zones of avoidance entered, one per positioner, by time
    opening: tuple[Opening, ...] = ()  #: pairs that begin nearer than the margin and are proven only to come apart
    assumptions: tuple[str, ...] = ()  #: what the proof rests on, in words; empty if nothing
    geometry: Geometry | None = None  #: which arms, bodies and obstacles it is about; None: not said (older files)
    subject: Subject | None = field(default=None, repr=False)  #: the motion, and of which array; None: a mere record

    def __post_init__(self) -> None:
        for name, dtype in (("pairs", np.int64), ("clearance", float)):
            for field_ in (name, f"obstacle_{name}"):
                object.__setattr__(self, field_, read_only(getattr(self, field_), dtype))

    def __repr__(self) -> str:
        return f"<Certificate: {self}>"

    def _repr_html_(self) -> str:
        return notebook_function("certificate_html")(self)

    @property
    def ok(self) -> bool:
        """Whether the motion is proven safe."""
        return not (self.contacts or self.undecided or self.violations or self.zones)

    @property
    def smallest(self) -> float:
        """Proven lower bound of the clearance of any pair looked at [mm]; inf if there is none."""
        return float(min(self.clearance.min(initial=np.inf), self.obstacle_clearance.min(initial=np.inf)))

    @cached_property
    def tolerates(self) -> Tolerated:
        """What the motion tolerates at margin 0, beyond what is allowed for: clocks, arms that are off, stalls.

        Raises:
            TrajectoryError: the motion is not known, as of a certificate that was read as a record.
        """
        subject, wide, looked = self.subject, self, self.margin
        if subject is None:
            raise TrajectoryError("a certificate that was read as a record has no motion: verify the motion")
        if not self.jitter:  # clearances are known up to a little above the margin: look farther
            looked += CAP
            wide = verify(subject.plane, subject.trajectory, looked, position_error=subject.errors)
        gaps = np.concatenate([wide.clearance, wide.obstacle_clearance])
        pairs = np.concatenate([wide.pairs, wide.obstacle_pairs * [1, -1] - [0, 1]])
        return tolerated(subject, self.jitter, pairs, gaps, looked)

    def __str__(self) -> str:
        count = len(self.pairs) + len(self.obstacle_pairs)
        if self.ok:
            proven = (
                f"smallest proven clearance {np.floor(self.smallest * 1e3) / 1e3:.3f} mm"
                if count
                else "nothing is within reach"
            )
            nearer = f"; {len(self.opening)} begin nearer and only come apart" if self.opening else ""
            return f"safe: {proven} (margin {self.margin:g} mm, {count} pairs{nearer})"
        parts = [(len(self.contacts), "contacts"), (len(self.undecided), "undecided pairs")]
        parts += [(len(self.violations), "violations"), (len(self.zones), "zones of avoidance entered")]
        return "not safe: " + ", ".join(f"{number} {what}" for number, what in parts if number)


def verify(
    plane: FocalPlane,
    trajectory: Trajectory | Executed,
    margin: float = 0.0,
    jitter: float = 0.0,
    position_error: float | np.ndarray = 0.0,
    opening: bool = False,
    known: Certificate | None = None,
) -> Certificate:
    """Prove that a motion keeps its distance, ranges and motors' limits and avoids what it must, or say where not.

    Args:
        plane: whose bodies move, and among which obstacles.
        trajectory: of all its positioners; of a motion as a controller executes it, joints and clocks may be off as it
            says, besides `position_error` and `jitter`.
        margin: clearance to keep at all times [mm]; equality cannot be decided.
        jitter: each positioner's clock may be off by this [s].
        position_error: each arm may be off by this, shared or (n,) [mm].
        opening: pairs that begin nearer than the margin, and joints that begin a little out of range, are no failure if
            they are proven only to come apart, or back.
        known: a proof of another motion of the same array, asked for with the same values: pairs that kept the margin,
            and whose arms move alike in both, are not looked at again.

    Raises:
        TrajectoryError: another number of positioners than the focal plane has, or a negative or non-finite margin,
            jitter or position error.
    """
    executed = trajectory if isinstance(trajectory, Executed) else Executed.exactly(trajectory)
    trajectory = executed.trajectory
    if trajectory.n != plane.n:
        raise TrajectoryError(f"the motion has {trajectory.n} positioners, the focal plane {plane.n}")
    margin = number(margin, "mm", "margin", TrajectoryError)
    jitter = number(jitter, "s", "jitter", TrajectoryError)
    error = read_only(position_error, unit="mm", name="position error", error=TrajectoryError)
    if error.shape not in ((), (plane.n,)):
        raise TrajectoryError(f"position error must be one number or {plane.n}, got shape {error.shape}")
    error = np.broadcast_to(error, (plane.n,))
    assert executed.online is not None  # set on construction
    online = plane.online & executed.online
    judged = plane if np.array_equal(online, plane.online) else plane.replace(online=online)
    error, jitter = error + motion_bounds(plane, executed.joint_error), jitter + executed.clock_error
    if not (np.isfinite([margin, jitter, *error]).all() and margin >= 0 and jitter >= 0 and (error >= 0).all()):
        raise TrajectoryError(f"margin {margin}, jitter {jitter} and position error must be finite and 0 or more")
    path = as_motion(plane.arms, trajectory)
    drift = jitter * float(path.knots["speed"].max()) if jitter else 0.0
    if max(error.max(initial=0.0), jitter) > LARGEST or LARGEST < drift < np.inf:  # joints may have no speed limit
        raise TrajectoryError(f"position error {error.max():g} mm or jitter {jitter:g} s is more than {LARGEST:g} mm")
    errors = np.concatenate([error, np.zeros(len(plane.obstacles))])
    errors = read_only(errors + rounding(plane.arms, path.offsets, path.knots))
    widest = margin + 2.0 * min(float(errors.max(initial=0.0)) + drift, EVERYONE)
    pairs = plane.arm_pairs_within(widest + 1e-6)
    subject = Subject(judged, trajectory, read_only(error))
    low = np.full(len(pairs), np.nan) if known is None else taken_over(known, subject, pairs, margin, jitter)
    seen, when, new = low.copy(), np.full(len(pairs), np.nan), np.isnan(low)
    asked = read_only(pairs[new], np.int64)
    low[new], seen[new], when[new] = judge(plane.arms, path, asked, errors, margin, jitter, TOLERANCE, margin + CAP).T
    if jitter and not (low >= margin).all():
        near = np.flatnonzero(~(low >= margin))
        some = read_only(pairs[near], np.int64)
        low[near], seen[near] = judge_clocks(plane.arms, path, some, errors, margin, jitter, TOLERANCE, margin).T

    moves = np.concatenate([online, np.zeros(len(plane.obstacles), bool)])
    opened = _opened(plane, path, pairs, errors, low, moves, margin, jitter) if opening else {}
    for row, pair in opened.items():
        low[row] = pair.clearance - OPENING
    contacts: list[Contact] = []
    undecided: list[Contact] = []
    resting: list[Contact] = []
    for k in np.flatnonzero(~(low >= margin)):
        if k in opened:
            continue
        i, j = (int(arm) for arm in pairs[k])
        contact = Contact((plane.public(i), plane.public(j)), float(when[k]), float(seen[k]))
        if not (moves[i] or moves[j]):
            resting.append(contact)
        else:
            (undecided if seen[k] >= margin else contacts).append(contact)
    fixed = pairs[:, 1] >= plane.n
    return Certificate(
        margin=float(margin),
        jitter=float(jitter),
        position_error=float(error.max(initial=0.0)),
        pairs=read_only(pairs[~fixed], np.int64),
        clearance=read_only(low[~fixed]),
        obstacle_pairs=read_only(pairs[fixed] - np.array([0, plane.n]), np.int64),
        obstacle_clearance=read_only(low[fixed]),
        contacts=_by_time(contacts),
        undecided=_by_time(undecided),
        violations=tuple(violations(judged, trajectory, opening)),
        resting=_by_time(resting),
        zones=_zones(plane, path),
        opening=tuple(sorted(opened.values(), key=lambda o: (o.time, o.pair))),
        assumptions=(*_assumptions(plane), *executed.assumptions),
        geometry=geometry_of(plane),
        subject=subject,
    )


def _assumptions(plane: FocalPlane) -> Iterable[str]:
    """What a proof about this focal plane rests on."""
    yield from plane.assumptions
    if not plane.bodies:
        yield "no bodies: nothing can touch"


def _opened(
    plane: FocalPlane,
    path: Motion,
    pairs: np.ndarray,
    errors: np.ndarray,
    low: np.ndarray,
    moves: np.ndarray,
    margin: float,
    jitter: float,
) -> dict[int, Opening]:
    """Of the pairs that do not keep the margin, by row: those that begin nearer and are proven only to come apart."""
    rows = np.flatnonzero(~(low >= margin) & (moves[pairs[:, 0]] | moves[pairs[:, 1]]))
    if not len(rows):
        return {}
    first, reached, failed = judge_opening(plane.arms, path, read_only(pairs[rows], np.int64), errors, margin, jitter).T
    return {
        int(k): Opening((plane.public(pairs[k, 0]), plane.public(pairs[k, 1])), float(first[n]), float(reached[n]))
        for n, k in enumerate(rows)
        if np.isnan(failed[n])
    }


def _zones(plane: FocalPlane, path: Motion) -> tuple[ZoneEntry, ...]:
    """Online positioners that are not shown to stay out of their zone of avoidance, by time."""
    if not plane.kinematics.has_avoidance:
        return ()
    found = [
        ZoneEntry(i, float(time), float(length))
        for i, (time, length) in enumerate(zone_entries(plane.arms, path.offsets, path.knots))
        if plane.online[i] and not np.isnan(time)
    ]
    return tuple(sorted(found, key=lambda entry: (entry.time, entry.positioner)))


def _by_time(contacts: list[Contact]) -> tuple[Contact, ...]:
    return tuple(sorted(contacts, key=lambda c: (c.time, c.pair)))
