"""amend: another goal for one positioner of a plan that exists, and as little else changed as possible (ours).

Symbols: P the plan, i the positioner, g its new goal; F the positioners that are free to move otherwise than in P; H
the time allowed. The search is that of `planners.direct`, on the part of the array around F; all others move as in P.

Algorithm                                                             here
---------------------------------------------------------------------------------------------------------------------
 1  the problem with goal g for i, validated anew: a goal that        `one_goal.amend`, `one_goal._amended_problem`
      touches another or something at rest is refused
 2  everyone ends where P ends if it arrived, else anywhere safe      `one_goal._ends`
 3  H = the makespan of P, or what the joints of i need;              `rerouting.reroute`
      if all of it fails, the same with 5 % more (`longer`)
 4  F = {i}; five times, with more work each time:
 5    the part of the array that F could touch, as an array of its    `subarray.patch_around`, `Trajectory.select`
        own; lattices for it, with everyone on the path of P
 6    i on its cheapest path past all others                          `planners.direct.repair.place_each`
 7    contacts of F repaired, one at a time; from the third time      `planners.direct.repair.repair`
        on also two jointly
 8    the part is proven by `fiberplan.verify`; a pair that fails     `rerouting._Attempt.run`
        is kept 0.2 mm farther apart and repaired again
 9    if proven: P with the new paths of those that changed; end      `subarray.with_part`
10    else F grows by the positioners that F still touches
11  the whole is certified; if it is not safe, or nothing was found,  `one_goal.amend`
      everyone moves as in P and i is DEADLOCKED

The cost does not grow with the array, except for line 11. `one_goal` decides what becomes of the plan, `rerouting`
searches, and `subarray` cuts a part out of a focal plane and its motion and puts it back. `targets` amends several
goals, each given as a target. `mending` uses lines 4 to 10 to lead positioners farther past each other than they went.
"""

from fiberplan.planners.amending.mending import mended
from fiberplan.planners.amending.one_goal import amend

__all__ = ["amend", "mended"]
