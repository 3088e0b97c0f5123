"""The direct planner: from any safe configuration straight to any other.

A lattice of joint angles and time for every positioner (`lattice`); what others shut of it (`shadows`); the cheapest
way of one (`single`) and joint ways of two (`pairs`) through everyone else's; the local search over both (`repair`),
with the decisions about time and losses (`search`); and the planner that is called (`planner`).
"""

from fiberplan.planners.direct.planner import Direct

__all__ = ["Direct"]
