"""Compiles the kernels once, before workers start that would each compile them: every planner, proof and tool."""

import numpy as np

import fiberplan as fp
from fiberplan.cli.app import run
from fiberplan.planners import PLANNERS, amend
from fiberplan.scenes.decisive import exchange
from problems import behind_posts, four_bars

OPTIONS = {"prioritized-roadmap": {"grid": (2, 2), "dt": 1.0, "max_time": 25.0, "orders": 1, "continuous": True}}


def main():
    run(["warmup"])
    for scene in (exchange, behind_posts):
        for name, planner in PLANNERS.items():
            plan = planner(**OPTIONS.get(name, {})).plan(scene())
            plan.faults()
    amend(plan, 1, plan.problem.start[1] + np.radians([1.0, -1.0]))
    fp.planners.PrioritizedRoadmap(**OPTIONS["prioritized-roadmap"]).plan(four_bars()).faults()


if __name__ == "__main__":
    main()
