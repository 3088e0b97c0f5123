"""What a planner returns, and why it is as it is.

- `plan`: a motion that is safe as it stands, with an `Outcome` for every positioner
- `outcomes`: what every planner says alike: outcomes that the problem settles, and who was in the way
- `seeds`: which seeds there are
- `diagnosis`: who did not arrive and why, what set the duration, how often joints turn back
"""

from fiberplan.plan.diagnosis import diagnose
from fiberplan.plan.outcomes import Outcome
from fiberplan.plan.plan import Plan

__all__ = ["Outcome", "Plan", "diagnose"]
