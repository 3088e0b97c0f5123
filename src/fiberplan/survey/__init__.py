"""From a catalogue to a proven survey: which positioner takes which target, with the motion in the loop.

For outside allocators `conflicts` gives every option and every two that touch at rest; `allocate` is our own:

1. `catalogue`: candidate targets, with priorities, tiers, kinds of fiber and categories
2. `standing`: where everyone stands now, and who can move; `options`: positioner, target and angles that bring it there
3. `conflicts`: which options touch each other, or what stands still
4. `quotas`: required positions, such as sky, spread over regions; `levels`: what options are worth, level by level
5. `choices`: all of it as numbers; `local_search`: a good set; `cliques`: at most one of each; `solve`: the best set
6. `motion`: plan, rule out who is lost together, choose again around them, until all arrive
7. `allocate`: these steps in order; `allocation`: what comes of them; `reasons`: why the rest has no positioner

`sky` brings targets from the sky into the focal plane, and `batch` does field after field: `run`.
"""

from fiberplan.survey.allocate import allocate
from fiberplan.survey.allocation import Allocation
from fiberplan.survey.batch.fields import Fields
from fiberplan.survey.batch.order import Order, order
from fiberplan.survey.batch.run import run
from fiberplan.survey.batch.survey import Survey
from fiberplan.survey.batch.survey_targets import SurveyTargets
from fiberplan.survey.catalogue import Catalogue
from fiberplan.survey.conflicts import ConflictTable, conflicts
from fiberplan.survey.options import Options
from fiberplan.survey.reasons import Reason, Why
from fiberplan.survey.sky import SkyPositions, Telescope

__all__ = [
    "Allocation",
    "Catalogue",
    "ConflictTable",
    "Fields",
    "Options",
    "Order",
    "Reason",
    "SkyPositions",
    "Survey",
    "SurveyTargets",
    "Telescope",
    "Why",
    "allocate",
    "conflicts",
    "order",
    "run",
]
