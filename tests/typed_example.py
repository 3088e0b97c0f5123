"""What a user's program may look like to a strict type checker; `make check` checks it, and `test_api` runs it."""

from pathlib import Path

import numpy as np
import numpy.typing as npt

import fiberplan as fp


def planned(margin: float) -> fp.Plan:
    plane = fp.FocalPlane.hexagonal(1, 22.4, (7.4, 15.0), margin, name="seven")
    targets: fp.Targets = fp.scenes.clustered_targets(plane, seed=1, margin=margin)
    problem: fp.Problem = fp.Problem.from_targets(plane, targets, margin=margin, conflicts="drop")
    planner = fp.planners.GreedyFold(step=float(np.radians(1.0)), seed=0)
    return planner.plan(problem)


def told(plan: fp.Plan, folder: Path) -> list[str]:
    plan.write(folder / "plan.fits")
    again: fp.Plan = fp.Plan.read(folder / "plan.fits")
    certificate: fp.Certificate = fp.verify(again.problem.plane, again.trajectory, margin=again.problem.margin)
    contacts: tuple[fp.Contact, ...] = certificate.contacts
    lines: list[str] = [again.summary(), str(certificate), f"{len(contacts)} contacts, safe: {certificate.ok}"]
    for part in again:
        end: npt.NDArray[np.float64] = part.end
        outcome: fp.Outcome = part.outcome
        lines.append(f"{part.id} {outcome.name} {end.tolist()} {part.blockers}")
    first: fp.PositionerPlan = plan["R0C1"]
    diagnosis: fp.Diagnosis = fp.diagnose(plan)
    lines.append(f"{first.index} {diagnosis.makespan:.3f} {fp.Trajectory.at_rest(plan.trajectory.end).duration}")
    try:
        fp.amend(plan, "R0C1", np.full(2, 100.0))
    except fp.ProblemError as error:
        lines.append(str(error))
    return lines
