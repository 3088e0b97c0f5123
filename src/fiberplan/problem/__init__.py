"""What is asked of a planner, validated before any planning.

- `targets`: where fibers are wanted; `solution`: the joint angles that put them there
- `agreement`: angles and positions of the same rows, and names of the same robots, compared; `left_out`: targets that
  no positioner can have
- `state`: where everyone stands, who can move, how well that is known; `guesses` and `resting`: where to stand when
  that is unknown, or when there is nowhere to go
- `problem`: from where, to where, how far apart, what matters most; `starts`: from where, if the targets' source says
- `goals`: which goals are refused or dropped, and why; `faults`: what can be wrong with a configuration
- `configuration_choice`: of several configurations that reach the same targets, those that do not touch
- `least_cover`: the goals of least total priority whose loss settles every contact
"""

from fiberplan.problem.goals import Dropped
from fiberplan.problem.problem import Problem
from fiberplan.problem.state import State
from fiberplan.problem.targets import Targets

__all__ = ["Dropped", "Problem", "State", "Targets"]
