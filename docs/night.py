"""A night of five fields without human help: a robot dies, a target of opportunity arrives, a move is aborted.

Every motion is planned, written for the controllers, read back and proven, and executed by robots whose clocks and
joints are a little off; each plan begins where that left them. `docs/night.md` tells what happens.

Usage: python docs/night.py [FOLDER of calibration tables]
"""

import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

import fiberplan as fp
from fiberplan.errors import ProblemError
from fiberplan.hardware.planned import fitted
from fiberplan.hardware.simulated import Faults, simulated, state_after
from fiberplan.plan.diagnosis import losses
from fiberplan.planners.amending.targets import amend_to

MARGIN = 0.8  # [mm]
REAL = Faults(latency=0.005, drift=2e-5, tracking=np.radians(0.02))  # what clocks and joints are off by
DATA = Path(__file__).parents[2] / "shared" / "data" / "sdss" / "apo" / "wok_calibs" / "sloanFlatCMM"


class Night:
    """The focal plane, where everyone stands, and the log."""

    def __init__(self, plane: fp.FocalPlane, folder: Path, log: Callable[[str], None]):
        self.plane, self.folder, self.log = fitted(plane, "sdss"), folder, log
        self.state = fp.State.folded(self.plane)
        self.moves = 0

    def plan(self, targets: fp.Targets, seed: int) -> fp.Plan:
        """From where everyone stands to a field; goals that cannot be are dropped, by name."""
        problem = fp.Problem.from_targets(self.plane, targets, start=self.state, margin=MARGIN, conflicts="drop")
        return fp.planners.Direct(seed=seed).plan(problem)

    def move(self, what: str, plan: fp.Plan, abort: float = np.inf) -> None:
        """Write a plan for the controllers, which proves what they make of it, and execute it."""
        self.moves += 1
        file = self.folder / f"trajectory-{self.moves:04d}.json"
        done = fp.hardware.sdss.write(plan, file)  # or it raises, and there is no file
        executed = fp.hardware.sdss.read(file, self.plane, self.state)
        faults = Faults(REAL.latency, REAL.drift, REAL.tracking, abort=abort)
        motion = simulated(executed.trajectory, faults, seed=self.moves)
        touching = fp.verify(self.plane, motion, opening=True).contacts
        self.log(f"{what}: {plan}; {file.name}, {done.facts['points']} points")
        self.log(f"  executed: {done.certificate}")
        for loss in losses(plan):
            why, names = loss.cause.partition(":")[0], ", ".join(loss.names)
            self.log(f"  lost: {loss.id}: {why}" + (f"; in the way: {names}" if names else ""))
        for contact in touching:
            names = " and ".join(self.plane.label(k) for k in contact.pair)
            self.log(f"  CONTACT: {names} at {contact.time:.2f} s")
        if abort < motion.duration + REAL.latency:
            short = int((np.abs(motion.end - plan.trajectory.end) > np.radians(1.0)).any(axis=1).sum())
            self.log(f"  aborted at {abort:.1f} s: {short} robots are short of their goals, where the next plan begins")
        elif not touching:
            self.log("  all there, nothing touched")
        self.state = state_after(self.plane, motion, faults, self.state)

    def dies(self, robot: int) -> None:
        """A robot answers no more: it stands where it is."""
        self.state = self.state.without(self.plane, [robot], "it does not answer")
        self.log(f"  {self.plane.ids[robot]} does not answer: offline where it stands, the others move around it")

    def opportunity(self, plan: fp.Plan, x: float, y: float) -> fp.Plan:
        """The plan with a target of opportunity, taken by a robot near it; one whose goal is in the way gives it up."""
        plane = self.plane
        near = np.argsort(np.hypot(*(plane.base - (x, y)).T), kind="stable")
        for i in near[plan.problem.plane.online[near]][:6].tolist():
            target = fp.Targets(np.array([x]), np.array([y]), positioner=(plane.ids[i],), source="opportunity")
            amended = self._taken(plan, target, i)
            if amended is not None:
                gave_up = [plane.ids[k] for k in np.setdiff1d(amended.lost, plan.lost).tolist()]
                for note in amended.notes[len(plan.notes) :]:
                    self.log(f"  opportunity at ({x:.1f}, {y:.1f}) mm: {note}")
                self.log(f"  opportunity: targets given up for it: {', '.join(gave_up) or 'none'}")
                return amended
        self.log(f"  opportunity at ({x:.1f}, {y:.1f}) mm: no robot near it can take it, the plan stays")
        return plan

    def _taken(self, plan: fp.Plan, target: fp.Targets, i: int) -> fp.Plan | None:
        """The plan in which robot i takes the target, if it can."""
        for _ in range(2):
            try:
                amended = amend_to(plan, target)
            except fp.TargetError:
                return None
            except ProblemError as refusal:
                others = [k for k in refusal.positioners if k != i and plan.problem.has_goal[k]]
                if len(others) != 1:
                    return None
                plan = fp.amend(plan, others[0], [np.nan, np.nan])
                continue
            return amended if amended.outcomes[i] is fp.Outcome.ARRIVED else None
        return None


def night(plane: fp.FocalPlane, folder: Path, log: Callable[[str], None] = print, first: int = 1) -> Night:
    """Five fields and the way home.

    Args:
        plane: of SDSS' kind.
        folder: where trajectories are written.
        log: takes a line.
        first: number of the first field, of those that `fp.scenes` makes up.
    """
    tonight = Night(plane, folder, log)
    for number in range(1, 6):
        targets = fp.scenes.clustered_targets(tonight.plane, seed=first + number, margin=MARGIN)
        plan = tonight.plan(targets, seed=number)
        if number == 3:
            middle = tonight.plane.base[np.argmin(np.hypot(*tonight.plane.base.T))]
            plan = tonight.opportunity(plan, float(middle[0]) + 5.0, float(middle[1]) + 12.0)
        if number == 4:
            tonight.move("field 4", plan, abort=1.0 + 0.5 * plan.makespan)
            plan = tonight.plan(targets, seed=number)
        tonight.move(f"field {number}{' again' if number == 4 else ''}", plan)
        if number == 2:
            arrived = plan.having(fp.Outcome.ARRIVED)
            tonight.dies(int(arrived[len(arrived) // 4]))
    able = (tonight.plane.online & tonight.state.online)[:, None]
    home = fp.Problem(
        tonight.plane,
        tonight.state,
        np.where(able, tonight.plane.folded, np.nan),
        MARGIN,
        conflicts="drop",
        near_start="open",
    )
    tonight.move("home", fp.planners.Direct(seed=6).plan(home))
    return tonight


if __name__ == "__main__":
    source = sys.argv[1] if len(sys.argv) > 1 else str(DATA) if DATA.is_dir() else "sdss"
    night(fp.FocalPlane.load(source), Path(tempfile.mkdtemp()))
