"""Plans for a controller: what it makes the motors do is proven while there is still time to plan otherwise.

Each attempt is written for the controller, read back and proven, as an export is; pairs that the executed motion brings
too near are led past each other farther apart, or all is planned anew (`fiberplan.shaping.replanned`). So an export of
the plan that comes out does what it did here.
"""

import tempfile
from pathlib import Path
from typing import Any

from fiberplan.certificates import Certificate
from fiberplan.errors import PlanError, UnprovenError
from fiberplan.focal_plane import FocalPlane
from fiberplan.hardware.controller import CONTROLLERS
from fiberplan.plan import Plan
from fiberplan.planners import Planner
from fiberplan.problem import Problem
from fiberplan.shaping.replanned import ROUNDS, UNIT, Made, replanned


def fitted(plane: FocalPlane, controller: str) -> FocalPlane:
    """The focal plane with the joint ranges, speeds and accelerations that a controller and its motors have.

    Raises:
        FiberplanError: no such controller.
    """
    fit = getattr(CONTROLLERS.find(controller), "with_limits", None)  # another package's may have none
    return plane if fit is None else fit(plane)


def plan_for(controller: str, planner: Planner, problem: Problem, rounds: int = ROUNDS, **options: Any) -> Plan:
    """The planner's plan as the controller can execute it; `executed` proves it.

    Args:
        controller: its name in `CONTROLLERS`.
        planner: any.
        problem: best of a focal plane that is `fitted`.
        rounds: times that the planner may be asked.
        **options: of the controller's `write`.

    Returns:
        the best plan, whose executed motion is proven if one's is; its last note says how often it was planned.

    Raises:
        PlanError: what the controller cannot do, by robot and moment.
        ProblemError: a goal at which it cannot end, where conflicts are refused.
        FiberplanError: no such controller.
    """
    writes = CONTROLLERS.find(controller)
    fit, with_goals = getattr(writes, "fit", None), getattr(writes, "with_goals", None)
    problem = problem if with_goals is None else with_goals(problem, **options)

    def made(plan: Plan) -> Made:
        kept = plan if fit is None else fit(plan)
        lacking: dict[tuple[int, int], float] = {}
        for proof in (executed(controller, kept, **options), kept.certificate):
            for each in (*proof.contacts, *proof.undecided):
                lacking[each.pair] = max(lacking.get(each.pair, 0.0), proof.margin - each.clearance)
        return Made(kept, lacking)

    return replanned(planner, problem, made, rounds, getattr(writes, "SEGMENT", UNIT))


def executed(controller: str, plan: Plan, **options: Any) -> Certificate:
    """Proof of what a controller makes the motors do, or what is wrong with it; no file is left behind.

    Raises:
        PlanError: what the controller cannot do, by robot and moment, or a motion that begins or ends elsewhere.
        FiberplanError: no such controller.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / controller
        try:
            done = CONTROLLERS.find(controller).write(plan, path, **options)
        except UnprovenError as error:
            if isinstance(error.certificate, Certificate):
                return error.certificate
            raise PlanError(str(error).removeprefix(f"{path}: not written: ")) from None
        except PlanError as error:
            raise PlanError(str(error).removeprefix(f"{path}: ")) from None
    return plan.certificate if done is None else done.certificate
