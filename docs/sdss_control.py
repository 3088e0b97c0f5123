"""What a control program of SDSS-V asks of a planner: positions and goals in, trajectories there and back out.

Plain dictionaries, by robot, angles in degrees; `docs/sdss-control.md` sets it beside what such programs do today.

Usage: python docs/sdss_control.py
"""

import numpy as np

import fiberplan as fp
from fiberplan.hardware.planned import fitted

Angles = dict[str, tuple[float, float]]  # robot -> alpha, beta [deg]
Paths = dict[str, dict[str, list[list[float]]]]  # robot -> "alpha" and "beta" -> points [deg, s]
MARGIN = 0.8  # between arms [mm]


class Planned:
    """Trajectories to the goals and back, and what became of each robot."""

    def __init__(self, plan: fp.Plan, back: fp.Plan):
        self.plan = plan
        self.to_destination: Paths = fp.hardware.sdss.trajectory(plan)
        self.from_destination: Paths = fp.hardware.sdss.trajectory(back)
        self.lost = {plan[i].id: str(plan.outcomes[i].value) for i in plan.lost.tolist()}

    @property
    def did_fail(self) -> bool:
        """Whether a robot does not get to its goal."""
        return bool(self.lost)


def paths(
    plane: fp.FocalPlane, positions: Angles, goals: Angles, offline: tuple[str, ...] = (), seed: int = 0
) -> Planned:
    """Trajectories that take robots from their positions to their goals, and back the same way.

    Args:
        plane: the array, its robots named by number or hole.
        positions: of all robots; one that is not given cannot move and is taken as folded.
        goals: of those that are to go somewhere; the others give way if they have to.
        offline: robots that cannot move.
        seed: of the planner.

    Raises:
        fp.FiberplanError: what cannot be, in one line that names the robot.
    """
    plane = fitted(plane, "sdss")
    start, known = np.array(plane.folded), np.zeros(plane.n, bool)
    for robot, angles in positions.items():
        start[plane.index_of(robot)], known[plane.index_of(robot)] = np.radians(angles), True
    online = plane.online & known
    online[[plane.index_of(robot) for robot in offline]] = False
    goal = np.full((plane.n, 2), np.nan)
    for robot, angles in goals.items():
        goal[plane.index_of(robot)] = np.radians(angles)
    state = fp.State(start, online, unknown=~known, source="positions")
    problem = fp.Problem(plane, state, goal, MARGIN, conflicts="drop", near_start="open")
    plan = fp.planners.Direct(seed=seed).plan(problem)
    there = fp.State(plan.trajectory.end, online, unknown=~known, source="goals")
    to_start = np.where(plan.problem.plane.online[:, None], plan.trajectory.start, np.nan)
    way_back = fp.Problem(plane, there, to_start, MARGIN, conflicts="drop", near_start="open")
    arrived = [fp.Outcome.ARRIVED if able else fp.Outcome.OFFLINE for able in plan.problem.plane.online]
    back = fp.Plan(way_back, plan.trajectory.reversed(), tuple(arrived), plan.planner)
    return Planned(plan, back)


if __name__ == "__main__":
    array = fp.FocalPlane.load("sdss")
    folded = {robot: tuple(np.degrees(angles)) for robot, angles in zip(array.ids, array.folded, strict=True)}
    field = fp.scenes.clustered_targets(array, seed=1, margin=MARGIN).configuration(array)
    wanted = {robot: tuple(np.degrees(angles)) for robot, angles in zip(array.ids, field, strict=True)}
    made = paths(array, folded, {robot: angles for robot, angles in wanted.items() if np.isfinite(angles).all()})
    print(made.plan)
    print(len(made.to_destination), "robots;", next(iter(made.to_destination.items())))
