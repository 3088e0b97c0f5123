"""Made-up fields, each the same for the same seed.

- `uniform`: configurations spread evenly over the patrol zones, as the papers test planners with
- `decisive`: the smallest scenes in which something has to give way
- `clustered`: targets clustered as galaxies are
- `sky`: a survey: targets in classes, clustered on the sky, and fields
- `assigned`: targets for probe arms, each with its arm
"""

from fiberplan.scenes.assigned import assignment_plan
from fiberplan.scenes.clustered import clustered_targets
from fiberplan.scenes.sky import clustered_sky
from fiberplan.scenes.uniform import uniform_field

__all__ = ["assignment_plan", "clustered_sky", "clustered_targets", "uniform_field"]
