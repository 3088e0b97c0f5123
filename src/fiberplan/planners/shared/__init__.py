"""What several planners use; none of it decides anything about a plan as a whole. Users in brackets.

- `goal_configurations`: which elbow solution to go to, the faster one (direct, navigation_function,
  elliptic_navigation)
- `requirements`: refuses kinds of arm that a planner does not know, and senseless seeds (direct, greedy_fold,
  navigation_function, elliptic_navigation, prioritized_roadmap, amending)
- `prepared`: problems as they come, for a planner that knows clear starts only (direct, greedy_fold,
  navigation_function, elliptic_navigation, prioritized_roadmap); `opening` here brings the near apart
- `opening`: brings those apart that begin nearer than the margin (separating, and `prepared` here)
- `memory`: refuses what would take too much memory, before it is taken (direct, greedy_fold,
  navigation_function, prioritized_roadmap, and `recording` here)
- `clusters`: positioners that could touch, grouped (greedy_fold, and `joint_paths` here)
- `safe_steps`: a step of all at once, granted as far as it is proven clear (navigation_function, elliptic_navigation)
- `step_limits`: speed and range limits of a step (navigation_function, elliptic_navigation)
- `repulsion`: the repulsive term of Makarem2014, sign mended (navigation_function, elliptic_navigation)
- `recording`: many small steps recorded as few knots (navigation_function, elliptic_navigation)
- `rrt_connect`: a joint path of a few positioners, the others at rest (greedy_fold, direct, and `joint_paths` here)
- `joint_paths`: joint paths, at the end, for those that a field left stuck (navigation_function)
- `threads`: work on many positioners at once, by all cores, with the same result for any number (direct)
- `straighten`: fewer knots, wherever an even move provably stays clear (greedy_fold, direct, amending)
"""
