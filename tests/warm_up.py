"""Compiles the kernels once, before workers start that would each compile them: every planner, proof and tool."""

import sys

import numpy as np

import fiberplan as fp
from fiberplan.planners import PLANNERS, amend
from fiberplan.scenes.decisive import exchange
from problems import behind_posts, four_bars

OPTIONS = {"prioritized-roadmap": {"grid": (2, 2), "dt": 1.0, "max_time": 25.0, "orders": 1, "continuous": True}}
SHARES = (
    ("direct",),
    ("greedy-fold", "elliptic-navigation-function", "navigation-function", "prioritized-roadmap"),
)


def main(share: int) -> None:
    """Compile what the planners of one share need: shares are compiled at the same time, and have little in common."""
    for scene in (exchange, behind_posts):
        for name in SHARES[share]:
            plan = PLANNERS[name](**OPTIONS.get(name, {})).plan(scene())
            plan.faults()
    if "direct" in SHARES[share]:
        amend(plan, 1, plan.problem.start[1] + np.radians([1.0, -1.0]))
    if "prioritized-roadmap" in SHARES[share]:
        fp.planners.PrioritizedRoadmap(**OPTIONS["prioritized-roadmap"]).plan(four_bars()).faults()


if __name__ == "__main__":
    main(int(sys.argv[1]))
