"""How soon the first contact is after one robot stops dead, for every planner, and what it costs to have more time.

547 robots (`sayres2021`), field to field, at buffers of 1.5 and 2.0 mm (margins of 0 and 1 mm). Reaction times are
proven lower bounds. With --least S, `Direct(min_reaction=S)` is planned too.

Usage: python benchmarks/reactions.py [--fields N] [--least S]
"""

import argparse
from typing import Any

import numpy as np

import fiberplan as fp
from fiberplan.certificates import reaction, stalls
from fiberplan.scenes.uniform import uniform_field
from measure import timed


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--fields", type=int, default=3, help="fields a margin")
    parser.add_argument("--least", type=float, default=None, metavar="S", help="reaction time to plan for (s)")
    options = parser.parse_args()
    plane = fp.FocalPlane.load("sayres2021")
    planners: dict[str, Any] = {
        "greedy-fold": fp.planners.GreedyFold(step=np.radians(1.0)),
        "direct": fp.planners.Direct(),
    }
    if options.least is not None:
        planners[f"direct, {options.least:g} s"] = fp.planners.Direct(min_reaction=options.least)
    heads = ("margin", "arrived", "time s", "react s", "median s", "CPU s", "its CPU s", "all CPU s")
    print(f"{'planner':<16} " + " ".join(f"{head:>10}" for head in heads))
    for margin in (0.0, 1.0):
        for field in range(options.fields):
            start, goal = (uniform_field(plane, 2 * field + k, margin) for k in (0, 1))
            for name, planner in planners.items():
                cpu, _, plan = timed(lambda: planner.plan(fp.Problem(plane, start, goal, margin)))  # noqa: B023
                assert plan.certificate.ok
                soon, _, found = timed(lambda: reaction(plane, plan.trajectory))  # noqa: B023
                each, _, all_of_them = timed(lambda: stalls(plane, plan.trajectory))  # noqa: B023
                numbers = (plan.makespan, found.seconds, np.median(all_of_them.seconds), cpu, soon, each)
                print(f"{name:<16} {margin:10.1f} {plan.arrivals:>10} ", end="")
                print(" ".join(f"{number:10.3f}" for number in numbers), flush=True)


if __name__ == "__main__":
    main()
