"""The direct planner: from any safe configuration straight to any other.

A lattice of joint angles and time for every positioner (`lattice`); the nodes that others block (`blocked_nodes`); the
cheapest path of one (`single`) and joint paths of two (`pairs`) or more (`untangle`) through everyone else's; which
paths touch (`contacts`); the local search over all that (`repair`), with the decisions about time and losses
(`search`); the configurations to go to (`goals`); from paths to knots (`trim`); and the planner that is called
(`planner`).
"""

from fiberplan.planners.direct.planner import Direct

__all__ = ["Direct"]
