"""PrioritizedRoadmap: Sabater2018's prioritized planning over roadmaps in joint space, line by line.

Symbols: arms i = 1..n; (theta1, theta2) their joints; ZoA the zone of avoidance; T_f the longest time allowed
(`max_time`); dt the step; nSSC the number of start-stops allowed (`max_stops`). A state of the search is (s, c, m, t):
step s on a path, start-stops c so far, motion m in {-1, 0, +1}, time t. An arm is asked two questions only: is a
configuration in its ZoA, and is it in contact with the arms planned before it at time t. So any kind of arm will do.

Paper (sections 3 and 4)                                              here
---------------------------------------------------------------------------------------------------------------------
 1  vertices V_i: an 8 x 6 grid of the joint space, without ZoA       `roadmap.cells`
 2  middle edges E_i: random disjoint pairs of V_i                    `roadmap.middle_edges`
 3  paths start-goal, start-v-goal, start-v-w-goal of straight        `roadmap.paths`, `roadmap.cut`
      edges, none through the ZoA nor of T_f or more; shortest first
 4  order of arms: longest direct path first                          `run.Search._longest_first`
 5  for each arm i in that order                                      `run.Search._pass`, `prioritized.Pass.arm`
 6    for each path, shortest first                                   `prioritized.Pass._over`
 7      depth-first from (0, 0, 0, 0): forward, wait, back            `edge_search.search`, `edge_search.ACTIONS`
 8        c grows by 1 when a motion changes, and at a vertex on
            the path; from standing still nothing is added; c <= nSSC
 9        the step is clear of the arms planned before i              `step_checks.step_clear`
10      at the end of the path: clear until the last arm arrives      `step_checks.first_rest`
11      the first motion found is kept                                `motions.Motion`
12  if an arm fails, plan again in another order                      `run.Search.run`, `run.Search._another`
13  if several orders fail, drop a target                             `run.Search._cost`: the order that loses least

What differs, and why: line 9 checks every `collision_dt`, as printed, but each check covers the time around it by a
motion bound, so that nothing can happen between checks. Line 7 mends the printed routine (integer steps within the
path, visited states keyed by all four parts, motion +1 forward), carries count and motion from edge to edge, and may go
back to earlier edges. Line 12: the arm that failed goes first, then random orders, `orders` in all. Line 13: an arm
without its target retracts to folded or stays where it is; one that can do neither in any order is held from the
beginning.

Future work of the paper, as options: `garages` (`garages.garages`, places to wait in); `varying` and `aside`
(`prioritized.Pass._someone_yields`: an arm yields from some moment on, or makes room after it has arrived);
`continuous` (`step_checks`: as few checks as the motion bound allows). `early_abort` leaves out searches that cannot
succeed. `planner.PrioritizedRoadmap` has the settings and makes the plan.
"""

from fiberplan.planners.prioritized_roadmap.planner import PrioritizedRoadmap

__all__ = ["PrioritizedRoadmap"]
