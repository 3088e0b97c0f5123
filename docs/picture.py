"""Draw the picture of the README: ``python docs/picture.py PLAN PICTURE``, half way through a plan."""

import sys
from pathlib import Path

from fiberplan.plan import Plan
from fiberplan.visuals.figures import draw


def main(plan_file: Path, picture: Path) -> None:
    """Draw the plan in `plan_file` as it stands after half its time."""
    plan = Plan.read(plan_file)
    draw(plan, "focal-plane", picture, time=plan.makespan / 2)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
