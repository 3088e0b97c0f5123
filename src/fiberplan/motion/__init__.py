"""Motion in joint space, whoever planned it.

- `trajectory`: knots for each positioner, even motion between them, rest before the first and after the last
- `executed`: what motors make of one, with the errors of their joints and clocks
- `moves`: the same as a list of moves, and its start-stops
"""

from fiberplan.motion.executed import Executed
from fiberplan.motion.trajectory import Trajectory

__all__ = ["Executed", "Trajectory"]
