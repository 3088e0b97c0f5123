"""From the sky to the focal plane, simply; teams with an optics code of their own hand in x and y instead.

- `positions`: where targets are on the sky, and where proper motion takes them
- `telescope`: field centre, position angle and radial plate scale, to x and y in mm
- ``telescopes/``: named telescopes, each number with its source
"""

from fiberplan.survey.sky.positions import SkyPositions
from fiberplan.survey.sky.telescope import Telescope

__all__ = ["SkyPositions", "Telescope"]
