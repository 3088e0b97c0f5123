"""GreedyFold: Sayres2021's greedy reverse path to a common folded state, line by line.

Symbols: robots i = 1..N with joints alpha and beta; `step` the turn of a joint per loop; sigma_buff half the thickness
of a beta arm with its buffer, so that two arms collide when their segments come closer than 2 sigma_buff (here: body
radius + half the margin). Folded is alpha = 0, beta = 180 deg in the paper, `FocalPlane.folded` here. The path from a
target to folded is easy, because all alphas turn the same way; it is searched and then played backwards.

Paper (section 3)                                                     here
---------------------------------------------------------------------------------------------------------------------
 1  reverse path from configuration q:                                `fold.Folding`, `walker.Walker`
 2    for loop = 1, 2, ... while loop x step <= 700 deg               `walker.Walker.run`, field `max_travel`
 3      for each robot i that is not folded, in turn                  `ranked_moves.run`
 4        for (s_alpha, s_beta) in (-,+) (0,+) (+,+) (-,0) (+,0)      `ranked_moves.RANKING`, written as towards folded,
              (-,-) (0,-) (+,-)                                         away from it, or hold
 5          q' = q_i + (s_alpha, s_beta) step, clamped at the limits  `walk_state.turns`, `walk_state.stepped`
 6          if robot i at q' collides with nobody: q_i = q', next i   `ranked_moves._choose`,
                                                                        `ranked_moves._refused_by`
 7      if all are folded: success                                    `ranked_moves.run` returns FOLDED
 8  deadlock: reverse the ranking of one robot for a while, or        `walker.Walker.reverse_ranking`
 9    give one stuck robot another target and begin again             `losses.Losses.replace_target`
10  motion from target A to target B = reverse path of A, then the    `planner.GreedyFold.plan`
      reverse path of B played backwards

What differs, and why:

- Line 4 acts per joint: a slower joint takes a proportionally smaller step, so that no speed limit is passed.
- Line 5: a move that a limit turns into nothing is skipped (`skip_noops`), because the printed rule accepts it for
  ever.
- Line 6: the printed test evaluates the end of the step, robots as they stand; recorded motion is simultaneous. Here
  a robot that moves later in a loop tests its whole move against the whole moves made before it in that loop, and must
  land far enough away that both can slide along each other next. The printed test remains as `Walker(swept=False)`.
- Line 6 is not evaluated while the robot cannot have used up its proven clearance (`wake` and `known` in `walk_state`).
- Line 7 compares with the stored folded angles; `walk_state.landed` takes rounding off at stops.
- Lines 8 and 9 are `relief="reverse"` and `"replace"`. The default `"joint"` is ours, and has three steps. First the
  stuck and who stood in their way (`deadlock.stuck_groups`) fold once more, past the others as these fold
  (`timed_relief.TimedRelief`, by a search over time, `timed_search.path_in_time`). If that leaves some, and alphas had
  to turn both ways, all fold by way of a state to which they turn the same way (`fold.Folding`). What is left then is
  given a joint path after all others have come to rest (`joint_relief.JointRelief`, `planners.shared.rrt_connect`);
  where there seems to be none, one robot of the group is given up and folded from the beginning.

Ours altogether: `losses.Losses` decides which goals are given up, in rounds that end, so that the plan still begins at
the start and is safe; `problem.resting` finds places for robots without goal; `planners.shared.straighten`
leaves a few knots of the many small steps.
"""

from fiberplan.planners.greedy_fold.planner import GreedyFold

__all__ = ["GreedyFold"]
