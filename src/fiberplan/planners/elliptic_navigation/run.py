"""One descent of the whole array from start to rest: the field, then rounds of relief, of which some are struck out."""

import numpy as np

from fiberplan.arrays import read_only
from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.neighbours import Neighbourhood, touched
from fiberplan.kernels.compile import kernel
from fiberplan.motion import Trajectory
from fiberplan.planners.elliptic_navigation.compaction import Block, closed_up
from fiberplan.planners.elliptic_navigation.descent import AIM, FULL, STILL, THERE, Scene, descend, look_around
from fiberplan.planners.elliptic_navigation.field import Field
from fiberplan.planners.elliptic_navigation.relief import Relief
from fiberplan.planners.elliptic_navigation.zones import circles, elliptic_zones
from fiberplan.planners.shared.recording import new_record, recorded, with_room
from fiberplan.planners.shared.safe_steps import stepping
from fiberplan.tolerances import UNDER_LIMIT

_LOOK = 0.5  # [s] between looks of the relief
_IDLE = 3.0  # [s] without anyone coming nearer after which the field is left
_ROUND = 30.0  # [s] at most


class Drive:
    """Positioners under way; `field` has the weights, `sizes` (n,) how large each takes zones for.

    Args:
        plane: the array.
        start: (n, 2) [rad].
        goal: (n, 2) where everyone belongs; those who have no target, somewhere safe [rad].
        margin: clearance to keep [mm].
        near: neighbour lists at that margin.
        field: the potential.
        sizes: (n,).
    """

    def __init__(
        self,
        plane: FocalPlane,
        start: np.ndarray,
        goal: np.ndarray,
        margin: float,
        near: Neighbourhood,
        field: Field,
        sizes: np.ndarray,
    ):
        n = plane.n
        self.plane, self._goal, self._near, self._field = plane, goal, near, field
        self._now, self._record = stepping(plane, start, margin, near), new_record(start)
        zones = elliptic_zones(plane)
        aim = np.zeros(n, AIM)
        most = plane.max_speed * (field.dt * UNDER_LIMIT)
        for k, joint in enumerate(("alpha", "beta")):
            aim[joint], aim[f"most_{joint}"] = goal[:, k], most[:, k]
            aim[f"lower_{joint}"], aim[f"upper_{joint}"] = plane.lower[:, k], plane.upper[:, k]
        aim["size"], aim["moves"], aim["best"], aim["refused"] = sizes, plane.online, np.inf, -1.0
        aim["middle"], aim["reach"] = circles(zones, plane.length)
        self._scene = Scene(zones, aim, np.zeros((n, 8)), np.zeros(2, np.int64))
        look_around(self._now, self._scene, field)
        self._blocks: list[Block] = []

    @property
    def angles(self) -> np.ndarray:
        """(n, 2) where everyone stands [rad]."""
        pose = self._now.pose[: self.plane.n]
        return np.stack([pose["alpha"], pose["beta"]], axis=1)

    @property
    def there(self) -> np.ndarray:
        """(n,) who is exactly where it belongs."""
        return (self.angles == self._goal).all(axis=1)

    @property
    def time(self) -> float:
        """Since the start [s]."""
        return float(self._scene.clock[0] * self._field.dt)

    def trajectory(self) -> Trajectory:
        """The motion so far, rounds of relief side by side where they may be."""
        return closed_up(recorded(self._record, self._field.dt), self._field.dt, self._blocks, self._near)

    def _descend(self, end: float) -> int:
        """Steps of the field for `_LOOK` or until `end` [s]; why that ended."""
        steps = max(1, round(min(_LOOK, end - self.time) / self._field.dt))
        while True:
            before = int(self._scene.clock[0])
            why = descend(self.plane.arms, self._near, self._now, self._record, self._scene, self._field, steps)
            if why != FULL:
                return int(why)
            steps -= int(self._scene.clock[0]) - before
            self._record = with_room(self._record, 8 * self.plane.n)

    def by_the_field(self, end: float) -> None:
        """Follow the field until all are there, nobody comes any nearer, or `end` [s]."""
        aim = self._scene.aim
        while self.time < end and self._descend(end) not in (THERE, STILL):
            under_way = aim["moves"] & ~aim["there"]
            if np.all(aim["quiet"][under_way] * self._field.dt > _IDLE):
                return

    def with_relief(self, worth: np.ndarray, rank: np.ndarray, patience: float, end: float) -> int:
        """Rounds of relief until nobody may lead any more, or until `end` [s]; how many were kept, in part at least.

        Args:
            worth: (n,) of being at the goal; 0 for those without a target.
            rank: (n,) the lower leads first.
            patience: time without coming nearer that counts as stuck [s].
            end: no round begins later than `_ROUND` before this [s].
        """
        relief = Relief(self._goal, self.plane.folded, rank, self.plane.online, self._near, patience)
        scene, kept = self._scene, 0
        while self.time + _ROUND <= end:
            there = self.there
            if not relief.begin(scene, np.flatnonzero(self.plane.online & (worth > 0) & ~there), there):
                break
            scene.clock[0] += 1  # at rest for a step, so that rounds can be told apart
            before, begin = self._checkpoint(), int(scene.clock[0])
            stop = self.time + _ROUND
            while self.time < stop and relief.look(scene, self._now, self._field.dt):
                self._descend(stop)
            gained = worth * (self.there.astype(float) - there)
            groups: dict[bool, list[np.ndarray]] = {True: [], False: []}
            for group in relief.groups():
                groups[bool(gained[group].sum() > 1e-12)].append(group)
            kept += bool(groups[True])
            self._strike_out(before, np.concatenate([*groups[False], np.empty(0, np.int64)]))
            last = self._record.track["step"]
            self._blocks += [Block(group, begin, int(last[group].max())) for group in groups[True]]
            scene.aim["alpha"], scene.aim["beta"] = self._goal.T
            look_around(self._now, scene, self._field)
        return kept

    def _checkpoint(self) -> tuple[np.ndarray, np.ndarray, int]:
        return self._now.pose.copy(), self._record.track.copy(), int(self._record.used[0])

    def _strike_out(self, before: tuple[np.ndarray, np.ndarray, int], who: np.ndarray) -> None:
        """Put `who` back to where they stood, as if they had rested; time goes back to the last motion that is left."""
        pose, track, used = before
        record, now = self._record, self._now
        for name in ("alpha", "beta"):
            now.pose[name][who] = pose[name][who]
        record.track[who] = track[who]
        knots = record.knots[used : record.used[0]]
        left = knots[~np.isin(knots["owner"], who)].copy()
        record.knots[used : used + len(left)] = left
        record.used[0] = used + len(left)
        for i in who:  # what was known of them was known of where they are no more
            now.known[self._near.near[self._near.offsets[i] : self._near.offsets[i + 1]]["pair"]] = -np.inf
        self._scene.clock[0] = record.track["step"].max()

    def in_the_way(self, who: np.ndarray) -> np.ndarray:
        """For each of `who` the arm it would touch first on a straight way from where it stands to its goal, or -1."""
        angles = self.plane.with_obstacles(self.angles).copy()
        return _first_touched(self.plane.arms, self._near, angles, who, self._goal, self._now.limit)


@kernel
def _first_touched(arms, near, angles, who, goal, limit):
    """First arm that each of `who` does not clear on a straight way to its goal, seen at a hundred places; or -1."""
    found = np.full(len(who), -1)
    for m in range(len(who)):
        i = who[m]
        alpha, beta = angles[i, 0], angles[i, 1]
        for k in range(1, 101):
            angles[i, 0] = alpha + (goal[i, 0] - alpha) * k / 100.0
            angles[i, 1] = beta + (goal[i, 1] - beta) * k / 100.0
            found[m] = touched(arms, near, angles, i, limit)
            if found[m] >= 0:
                break
        angles[i, 0], angles[i, 1] = alpha, beta
    return found


def weighted_width(plane: FocalPlane) -> float:
    """The weighted distance at which zones touch: twice the greatest half-width of a zone [mm]."""
    across = elliptic_zones(plane)["across"]
    return max(2.0 * float(np.sqrt(across.max(initial=0.0))), 1e-3)


def assigned_sizes(priority: np.ndarray, spread: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Zone sizes (n,) from 1 to 1 + `spread` and ranks (n,), fixed beforehand: greater priority has the smaller zone.

    Among equals the order is drawn from `seed`.
    """
    n = len(priority)
    drawn = np.random.default_rng([seed, 0x517E]).permutation(n)
    rank = np.empty(n, np.int64)
    rank[np.lexsort([drawn, -priority])] = np.arange(n)
    return read_only(1.0 + spread * rank / max(n - 1, 1)), rank
