"""The three rules under which each experiment is run.

*literal* is the listing as printed: a move is tested where it ends, and one that a joint limit turns into nothing is
taken. *sampled* passes over such moves. *certified* does too, and tests moves over the whole step.
"""

from dataclasses import dataclass

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.planners.greedy_fold.walker import Walker

MAX_TRAVEL = np.radians(700.0)  #: turn after which a trial is given up [rad]


@dataclass(frozen=True)
class Rule:
    """How a move is tested."""

    name: str
    swept: bool  #: over the whole step rather than at its end
    skip_noops: bool  #: a move that changes nothing is passed over rather than taken

    def walk(self, plane: FocalPlane, angles: np.ndarray, margin: float, step: float, near: Neighbourhood) -> Walker:
        """A walk of everyone from `angles` [rad] towards folded, as far as it goes, with no relief.

        Swept moves keep 0.5 um more than `margin` [mm], so that the proof has room; sampled ones, as in the paper, do
        not.
        """
        everyone = np.ones(plane.n, bool)
        walker = Walker(
            plane, angles, margin, step, everyone, swept=self.swept, skip_noops=self.skip_noops, neighbourhood=near
        )
        if not self.swept:
            walker.rules = walker.rules._replace(limit=float(margin))
        walker.run(MAX_TRAVEL)
        return walker


LITERAL = Rule("literal", swept=False, skip_noops=False)
SAMPLED = Rule("sampled", swept=False, skip_noops=True)
CERTIFIED = Rule("certified", swept=True, skip_noops=True)
RULES = (LITERAL, SAMPLED, CERTIFIED)
