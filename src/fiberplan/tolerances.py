"""Every tolerance that two rooms have to agree on, and why each is as large as it is.

Lengths are in order, and the order is what makes plans provable and chains of plans possible:

    ROUNDING < SLACK < EQUALITY < SCENE < NEAR

Planners keep `SLACK` more than the margin, so that the proof (which gives `ROUNDING` away) has room. A start and a goal
keep `EQUALITY`, so that a planner that keeps `SLACK` can leave the one and reach the other. Made-up fields keep
`SCENE`, so that `Problem` takes them. Neighbour lists hold everyone within `NEAR` of the margin, so that nobody about
whom one of the above is asked is missing.
"""

ROUNDING = 1e-9  #: taken off every proven bound for floating-point rounding [mm]
SLACK = 5e-4  #: planners keep this more than the margin [mm]
EQUALITY = 1e-3  #: start and goal keep this more than the margin: equality cannot be decided [mm]
SCENE = 2e-3  #: made-up fields keep this more than the margin [mm]
NEAR = 3e-3  #: neighbours of a planner come within this of the margin [mm]

OPENING = 1e-6  #: what is lost to rounding and to the proof while a pair comes apart [mm]
START_RANGE = 8.8e-3  #: a start this far out of a joint's range is accepted, and moves inwards first: 0.5 deg [rad]
ARRIVAL = 1e-3  #: a fiber this close to its goal has arrived [mm]
SAME_START = 1e-9  #: a plan begins this close to its problem's start [rad]
RANGE = 1e-9  #: a joint this far out of its range is at its end [rad]
SPEED = 1e-9  #: a joint faster by this part of its limit is at the limit
SAME_SPEED = 1e-6  #: pieces whose speeds differ by less than this part of the joint's limit are one piece
RAMP = 1.75e-3  #: straight pieces leave out this much of a ramp of speed at most: 0.1 deg [rad]
UNDER_LIMIT = 1.0 - 1e-9  #: planners use this part of a joint's speed, so that rounding never exceeds it
ZONE = 1e-6  #: a slider this far out of its limits is still in range [mm]
