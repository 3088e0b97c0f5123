"""What a planner returns, and why it is as it is.

- `plan`: a motion that is safe as it stands, with an `Outcome` for every positioner
- `positioner`: what a plan says of one positioner, and of all as a table
- `summary`: a plan in words
- `outcomes`: what can become of a positioner, what of it the problem settles, and who was in the way
- `closest`: which pairs come closest
- `loss_proofs`: proofs that a positioner had to lose its goal
- `bounds`: times that some need, whatever the others do
- `seeds`: which seeds there are
- `diagnosis`: who did not arrive and why, what set the duration, how often joints turn back
"""

from fiberplan.plan.bounds import Bound
from fiberplan.plan.diagnosis import Diagnosis, diagnose
from fiberplan.plan.outcomes import Outcome
from fiberplan.plan.plan import Plan
from fiberplan.plan.positioner import PositionerPlan

__all__ = ["Bound", "Diagnosis", "Outcome", "Plan", "PositionerPlan", "diagnose"]
