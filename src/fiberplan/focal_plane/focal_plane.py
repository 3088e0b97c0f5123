"""A focal plane: an array of positioners, what they can touch, and what stands fixed between them.

A positioner turns alpha about its base and beta about its elbow; beta is measured from the alpha link, so pi is folded.
Angles here are commanded ones: geometry adds each positioner's zero offsets (and the rotation of its frame, which is
part of them). Lengths in mm, angles in rad, times in s. The kind of arm is its `kinematics`: four-bar arms have the
same two commanded angles, which their papers call theta1 and theta2.
"""

import dataclasses
import difflib
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

import numpy as np

from fiberplan.arrays import Frozen, FrozenDict, number, plain, read_only, shortened, texts
from fiberplan.errors import InstrumentError
from fiberplan.focal_plane.bodies import Body, Obstacle
from fiberplan.focal_plane.checks import NO_LIMIT, UNITS, check
from fiberplan.focal_plane.compiled_arms import compile_arms
from fiberplan.focal_plane.discs import discs_at
from fiberplan.focal_plane.kinematics import Kinematics
from fiberplan.focal_plane.layouts import hexagonal_array
from fiberplan.focal_plane.motor_limits import least_time
from fiberplan.focal_plane.obstacle_pairs import obstacles_within
from fiberplan.focal_plane.two_link import TWO_LINK, rotated
from fiberplan.kernels.arms import Arms
from fiberplan.kernels.clearance import clearances
from fiberplan.kernels.neighbours import neighbour_pairs
from fiberplan.registry import io_function, notebook_function

TURN = 2 * np.pi
_MOST_GAPS = 4  # of which the pairs are kept: proofs of losses ask again and again for those of one
_PER_POSITIONER = ("base", "length", "folded", "lower", "upper", "max_speed", "zero", "online", *NO_LIMIT)


@dataclass(frozen=True, eq=False)
class FocalPlane(Frozen):
    """An array of two-joint positioners with obstacles.

    Raises:
        InstrumentError: a duplicate id, a value that is not finite, a reversed joint range, a speed or acceleration
            that is not positive, a least speed above the largest, or a folded state outside its range or in the zone
            of avoidance; the message names the positioner.
    """

    ids: tuple[str, ...]
    base: np.ndarray  #: (n, 2) alpha axes [mm]
    length: np.ndarray  #: (n,) base to elbow [mm]
    fiber_offsets: Mapping[str, np.ndarray]  #: name -> (n, 2) in the beta link's frame [mm]; the first is the default
    folded: np.ndarray  #: (n, 2) the park state, commanded [rad]
    lower: np.ndarray  #: (n, 2) joint ranges, commanded [rad]
    upper: np.ndarray  #: (n, 2) [rad]
    max_speed: np.ndarray  #: (n, 2) [rad/s]
    bodies: tuple[Body, ...]
    obstacles: tuple[Obstacle, ...] = ()
    zero: np.ndarray = None  # type: ignore[assignment]  #: (n, 2) added to commanded angles [rad]; zeros unless given
    online: np.ndarray = None  # type: ignore[assignment]  #: (n,) False: cannot move; all True unless given
    name: str = "unnamed"
    pair_margin: float = 5.0  #: pairs that could come within this of each other are neighbours [mm]
    notes: tuple[str, ...] = field(default=())  #: assumptions and sources worth printing beside a plan
    kinematics: Kinematics = TWO_LINK  #: the kind of arm, with what it has beyond base, first link and fiber
    field_radius: float = np.inf  #: targets lie this close to the origin [mm]
    aliases: tuple[str, ...] = ()  #: (n,) second names of the positioners, "" where there is none; or empty
    assumptions: tuple[str, ...] = ()  #: what this description rests on without a source, one sentence each
    recommended_margin: float | None = None  #: the margin to take where none is asked for [mm]
    forbidden: np.ndarray = None  # type: ignore[assignment]  #: (m, 3) x, y, radius [mm]: discs where no fiber may end
    site: str = ""  #: the observatory where it stands, if the source says it
    max_acceleration: np.ndarray | None = None  #: (n, 2) [rad/s^2], inf: no limit; None: no joint has one
    min_speed: np.ndarray | None = None  #: (n, 2) of a joint that turns [rad/s], 0: no limit; None: no joint has one

    def __post_init__(self) -> None:
        object.__setattr__(self, "ids", texts(self.ids, f"{self.name}: ids", InstrumentError))
        n = len(self.ids)
        defaults = {"zero": np.zeros((n, 2)), "online": np.ones(n, bool)}
        shapes = {"base": (n, 2), "length": (n,), "folded": (n, 2), "lower": (n, 2), "upper": (n, 2)}
        shapes |= {"max_speed": (n, 2), "zero": (n, 2), "online": (n,)} | dict.fromkeys(NO_LIMIT, (n, 2))
        for name, shape in shapes.items():
            value = getattr(self, name)
            if value is None and name in NO_LIMIT:
                continue
            dtype = bool if name == "online" else np.float64
            label, unit = f"{self.name}: {name}", UNITS.get(name, "rad")
            value = read_only(defaults[name] if value is None else value, dtype, unit, label, InstrumentError)
            if value.shape != shape:
                raise InstrumentError(f"{self.name}: {name} must have shape {shape}, got {value.shape}")
            none = name in NO_LIMIT and bool(np.all(value == NO_LIMIT[name]))
            object.__setattr__(self, name, None if none else value)
        lengths = ["pair_margin", "field_radius"]
        if self.recommended_margin is not None:
            lengths.append("recommended_margin")
        for name in lengths:
            value = number(getattr(self, name), "mm", f"{self.name}: {name}", InstrumentError)
            object.__setattr__(self, name, value)
        offsets = {name: self._offset(name, value) for name, value in self.fiber_offsets.items()}
        object.__setattr__(self, "fiber_offsets", FrozenDict(offsets))
        object.__setattr__(self, "bodies", tuple(self.bodies))
        object.__setattr__(self, "obstacles", tuple(self.obstacles))
        object.__setattr__(self, "aliases", tuple(str(name) for name in self.aliases))
        object.__setattr__(self, "assumptions", tuple(self.assumptions))
        object.__setattr__(self, "forbidden", read_only(np.empty((0, 3)) if self.forbidden is None else self.forbidden))
        check(self)

    def _offset(self, name: str, value: Any) -> np.ndarray:
        label = f"{self.name}: fiber '{name}'"
        given = read_only(value, unit="mm", name=label, error=InstrumentError)
        if given.shape not in ((2,), (1, 2), (self.n, 2)):
            raise InstrumentError(f"{label} must have shape ({self.n}, 2) or (2,), got {given.shape}")
        return read_only(np.broadcast_to(given, (self.n, 2)))

    def __repr__(self) -> str:
        parts = (self.n, "positioner"), (len(self.bodies), "body"), (len(self.obstacles), "obstacle")
        plural = {"body": "bodies"}
        listed = ", ".join(f"{k} {what if k == 1 else plural.get(what, f'{what}s')}" for k, what in parts)
        limits = [name for name in NO_LIMIT if getattr(self, name) is not None]
        return f"<FocalPlane '{shortened(self.name)}': {', '.join([listed, *limits])}>"

    def _repr_html_(self) -> str:
        return notebook_function("focal_plane_html")(self)

    def limit(self, name: str) -> np.ndarray:
        """(n, 2) `max_acceleration` [rad/s^2] or `min_speed` [rad/s], inf or 0 where joints have none."""
        given = getattr(self, name)
        return read_only(np.full((self.n, 2), NO_LIMIT[name])) if given is None else given

    def least_time(self, turn: np.ndarray, who: np.ndarray | slice = slice(None)) -> np.ndarray:
        """Least time [s] in which each joint can turn by `turn` (n, ..., 2) [rad] from rest to rest; NaN where it is.

        Args:
            turn: (n, ..., 2) of either sign.
            who: (n,) the positioners whose joints these are; all unless given.
        """
        shape = (-1, *(1,) * (np.ndim(turn) - 2), 2)
        limits = (self.max_speed, self.limit("max_acceleration"), self.limit("min_speed"))
        return least_time(turn, *(limit[who].reshape(shape) for limit in limits))

    @property
    def n(self) -> int:
        """Number of positioners."""
        return len(self.ids)

    @property
    def fiber(self) -> np.ndarray:
        """(n, 2) default fiber in the beta link's frame [mm]."""
        return next(iter(self.fiber_offsets.values()))

    @cached_property
    def index(self) -> dict[str, int]:
        """Positioner id -> index."""
        return FrozenDict((id_, i) for i, id_ in enumerate(self.ids))

    @cached_property
    def names(self) -> Mapping[str, int]:
        """Positioner id, or second name where no id reads the same -> index."""
        second = {name: i for i, name in reversed(list(enumerate(self.aliases))) if name}
        return second | self.index

    def index_of(self, name: str) -> int:
        """Index of the positioner of this id or second name.

        Raises:
            InstrumentError: there is none; one line with the nearest name, if one is near.
        """
        if name not in self.names:
            close = difflib.get_close_matches(name, list(self.names), n=1, cutoff=0.7)
            hint = f"; did you mean '{close[0]}'?" if close else ""
            raise InstrumentError(f"{self.name} has no positioner '{name}'{hint}")
        return self.names[name]

    def carries(self, fiber: str) -> np.ndarray:
        """(n,) whether each positioner carries the fiber of this name, whatever its case.

        Raises:
            InstrumentError: no fiber of that name.
        """
        return np.isfinite(self._carried(fiber)).all(axis=1)

    def _carried(self, fiber: str) -> np.ndarray:
        """(n, 2) of a fiber, whatever the case of its name, in the beta link's frame [mm]."""
        known = {name.lower(): name for name in self.fiber_offsets}
        if fiber.lower() not in known:
            raise InstrumentError(f"{self.name}: no fiber '{fiber}'; it has {', '.join(self.fiber_offsets)}")
        return self.fiber_offsets[fiber if fiber in self.fiber_offsets else known[fiber.lower()]]

    def replace(self, **changes: Any) -> "FocalPlane":
        """The same focal plane with some fields changed."""
        return dataclasses.replace(self, **changes)

    def subset(self, who: np.ndarray, obstacles: np.ndarray | None = None) -> "FocalPlane":
        """The focal plane of some of the positioners.

        Args:
            who: (k,) which, in this order.
            obstacles: (m,) which obstacles; all unless given.

        Raises:
            InstrumentError: nobody is left.
        """
        who = np.asarray(who)
        bodies = [body.subset(who) for body in self.bodies]
        fixed = self.obstacles if obstacles is None else [self.obstacles[k] for k in obstacles]
        there = {thing.category for thing in (*bodies, *fixed)}
        return self.replace(
            ids=tuple(self.ids[i] for i in who),
            fiber_offsets={name: offset[who] for name, offset in self.fiber_offsets.items()},
            bodies=tuple(body.meeting(there) for body in bodies),
            obstacles=tuple(obstacle.meeting(there) for obstacle in fixed),
            kinematics=self.kinematics.subset(who),
            aliases=tuple(self.aliases[i] for i in who) if self.aliases else (),
            **{name: getattr(self, name)[who] for name in _PER_POSITIONER if getattr(self, name) is not None},
        )

    def public(self, arm: int) -> int:
        """An arm as the kernels count it (obstacle k is arm n + k), as everyone else does: obstacle k is -1 - k."""
        return int(arm) if arm < self.n else self.n - 1 - int(arm)

    def arm(self, public: int) -> int:
        """A positioner, or obstacle -1 - k, as the kernels count it: obstacle k is arm n + k."""
        return int(public) if public >= 0 else self.n - 1 - int(public)

    def label(self, public: int) -> str:
        """A positioner, or obstacle -1 - k, as people know it; by its number if there is none such."""
        k = -1 - public
        if public >= 0:
            return self.ids[public] if public < self.n else f"positioner {public}"
        return f"obstacle {self.obstacles[k].name if k < len(self.obstacles) else k}"

    def links(self, angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Directions of both links (n,) [rad] at commanded `angles` (n, 2) [rad]."""
        return self.kinematics.links(self, _angles(angles))

    def elbows(self, angles: np.ndarray) -> np.ndarray:
        """Elbow positions (n, 2) [mm] at commanded `angles` (n, 2) [rad]."""
        return self.kinematics.elbows(self, _angles(angles))

    def fibers(self, angles: np.ndarray, fiber: str | None = None) -> np.ndarray:
        """Fiber positions (n, 2) [mm] at commanded `angles` (n, 2) [rad]; the default fiber unless one is named.

        Names know no upper and lower case. NaN rows for positioners that do not carry the fiber.

        Raises:
            InstrumentError: no fiber of that name.
        """
        offset = self.fiber if fiber is None else self._carried(fiber)
        angles = _angles(angles)
        _, second = self.links(angles)
        return self.elbows(angles) + rotated(offset, second)

    def forbidden_at(self, points: np.ndarray) -> np.ndarray:
        """(m,) which of the `forbidden` discs each of `points` (m, 2) [mm] lies in, -1 for none and for NaN."""
        return discs_at(self.forbidden, points)

    def in_avoidance(self, angles: np.ndarray) -> np.ndarray:
        """(n,) whether commanded `angles` (n, 2) [rad] are forbidden within the joint ranges; NaN rows are not."""
        return self.kinematics.in_avoidance(self, _angles(angles))

    def avoidance(self, i: int, angles: np.ndarray) -> str:
        """What is wrong with positioner `i`, whose commanded angles (n, 2) [rad] lie in its zone of avoidance."""
        return self.kinematics.avoidance(self, i, angles)

    @cached_property
    def arms(self) -> Arms:
        """The kernels' view: positioners, then obstacles (arm n + k is obstacle k)."""
        return self._compiled[0]

    @cached_property
    def _compiled(self) -> tuple[Arms, np.ndarray]:
        try:
            return compile_arms(self.base, self.length, self.zero, self.bodies, self.obstacles, self.kinematics)
        except InstrumentError as error:
            raise InstrumentError(f"{self.name}: {error}") from None

    @cached_property
    def pairs(self) -> np.ndarray:
        """(m, 2) positioners that could come within `pair_margin` of each other, sorted."""
        return self.pairs_within(self.pair_margin)

    @cached_property
    def obstacle_pairs(self) -> np.ndarray:
        """(m, 2) positioner and obstacle number that could come within `pair_margin` of each other."""
        return self.obstacle_pairs_within(self.pair_margin)

    def pairs_within(self, gap: float) -> np.ndarray:
        """(m, 2) positioners whose bodies could come within `gap` [mm], in O(n)."""
        gap = number(gap, "mm", "gap", InstrumentError)
        return read_only(neighbour_pairs(self.base, self.reach, gap), np.int64)

    def obstacle_pairs_within(self, gap: float) -> np.ndarray:
        """(m, 2) positioner and obstacle number whose bodies could come within `gap` [mm]."""
        gap = number(gap, "mm", "gap", InstrumentError)
        return read_only(obstacles_within(self.base, self.reach, self.obstacles, gap), np.int64)

    def arm_pairs_within(self, gap: float) -> np.ndarray:
        """(m, 2) pairs of arms, obstacles included (obstacle k is arm n + k), that could come within `gap` [mm]."""
        gap = number(gap, "mm", "gap", InstrumentError)
        known = self._known_pairs.get(gap)
        if known is None:
            obstacle = self.obstacle_pairs_within(gap) + np.array([0, self.n])
            known = read_only(np.concatenate([self.pairs_within(gap), obstacle]), np.int64)
            if len(self._known_pairs) >= _MOST_GAPS:
                self._known_pairs.clear()
            self._known_pairs[gap] = known
        return known

    @cached_property
    def _known_pairs(self) -> dict[float, np.ndarray]:
        return {}

    @cached_property
    def reach(self) -> np.ndarray:
        """(n,) farthest that any body point can be from the base, radii included [mm]."""
        return self._compiled[1]

    def thicker(self, by: np.ndarray) -> "FocalPlane":
        """The same with the bodies of each positioner thicker `by` (n,) on all sides [mm]."""
        return self.replace(bodies=tuple(dataclasses.replace(body, radius=body.radius + by) for body in self.bodies))

    def with_obstacles(self, angles: np.ndarray) -> np.ndarray:
        """`angles` (n, 2) followed by zeros for the obstacles, as the kernels take them."""
        angles = np.asarray(_angles(angles), float)
        return read_only(np.concatenate([angles, np.zeros((len(self.obstacles), 2))]))

    def clearance(self, angles: np.ndarray, pairs: np.ndarray | None = None) -> np.ndarray:
        """(m,) clearance of each pair [mm] at commanded `angles` (n, 2) [rad]; NaN where an angle is.

        Args:
            angles: of all positioners.
            pairs: (m, 2) of arms, as `arm_pairs_within` counts them; `self.pairs` unless given.
        """
        wanted = self.pairs if pairs is None else read_only(pairs, np.int64)
        return clearances(self.arms, self.with_obstacles(angles), wanted)

    @staticmethod
    def load(name_or_path: str | os.PathLike, conflicts: Literal["raise", "drop"] = "raise") -> "FocalPlane":
        """A named instrument (see ``fiberplan instruments``), or one from a file or folder.

        Args:
            name_or_path: of the instrument.
            conflicts: with "drop", a robot with a cell that cannot be used is offline, and named in notes and
                assumptions, instead of the whole refused; of DESI's files.

        Raises:
            InstrumentError: no such instrument or file, or one that cannot be used.
        """
        return io_function("load_focal_plane")(name_or_path, conflicts)

    def write(self, path: str | os.PathLike) -> None:
        """Write the whole focal plane as FITS tables, which `load` reads back exactly.

        Raises:
            InstrumentError: the file cannot be written.
        """
        io_function("write_focal_plane")(self, path)

    @classmethod
    def hexagonal(
        cls,
        rings: int,
        pitch: float,
        lengths: tuple[float, float] = (7.4, 15.0),
        radius: float = 1.5,
        max_speed: float | Sequence[float] = np.radians(30.0),
        lower: Sequence[float] = (0.0, 0.0),
        upper: Sequence[float] = (TURN, np.pi),
        folded: Sequence[float] = (0.0, np.pi),
        name: str = "hexagonal",
        bodies: Sequence[Body] | None = None,
    ) -> "FocalPlane":
        """A filled hexagon of 1 + 3 rings (rings + 1) equal positioners, numbered row by row from the lowest y.

        Rows run along x; ids are R<row>C<column> counted from the middle row and from the left.

        Args:
            rings: around the middle positioner, 0 or more.
            pitch: distance of neighbours in a row [mm].
            lengths: base to elbow and elbow to fiber [mm].
            radius: of the capsule from elbow to fiber that each beta arm is [mm], unless `bodies` are given.
            max_speed: of both joints, or of each [rad/s].
            lower: ends of the ranges of alpha and beta, as commanded [rad].
            upper: the other ends [rad].
            folded: where alpha and beta are parked [rad].
            name: of the focal plane.
            bodies: what can touch.

        Raises:
            InstrumentError: rings below 0, or values that make no focal plane.
        """
        joints = {"folded": folded, "lower": lower, "upper": upper, "max_speed": max_speed}
        return cls(**hexagonal_array(rings, pitch, lengths, radius, joints, bodies), name=name)


def _angles(angles: Any) -> Any:
    """Angles in rad, if they have a unit."""
    return plain(angles, "rad", "angles", InstrumentError)
