"""NavigationFunction: Makarem2014's decentralized navigation function, line by line.

Symbols: q_i the fiber end of positioner i, q_iT its target, x = |q_i - q_j|; theta and phi the joints (alpha and beta
here); D where repulsion begins, d the safety distance; lambda1, lambda2 weights; dt the step. The potential is

    psi_i = lambda1 |q_i - q_iT|^2 + lambda2 sum over neighbours j of max(0, (D^2 - x^2) / (x^2 - d^2)).      (Eq. 2)

Printed, the last term is min(0, (x^2 - D^2) / (x^2 - d^2)), whose descent attracts; its sign is mended.

Paper (section 3), ``mode="literal"``                                 here
---------------------------------------------------------------------------------------------------------------------
 1  of the elbow solutions take the faster: min over parities of      `planners.shared.goal_configurations`
      max_k |dq_k| / v_k
 2  repeat until |q_i - q_iT| <= convergence for all i, or for        `descent.descend_literally`, `descent.converged`
      `give_up` times the travel of the slowest joint
 3    f_i = - d psi_i / d q_i, of all from the positions at step m    `descent._ask_literally`, `descent.repelled`,
                                                                        `planners.shared.repulsion`
 4    (theta', phi') = J_i^T f_i                          (Eq. 4)     `fiber_ends.place_end`,
                                                                        `fiber_ends.through_joints`
 5    theta(m+1) = theta(m) + dt theta', likewise phi     (Table 1)   `descent.advance`

What the paper leaves open: both joints are scaled together to the speed limit and cut off at joint ranges
(`planners.shared.step_limits`); a pose in which the fiber cannot move along the arm is left by a seeded turn of phi
(`singular.nudged`); fibers that converged go exactly to their goal (`descent.settle`); a positioner that asks for
nothing sleeps until a neighbour comes near (`descent.wake_around`).

``mode="repaired"`` (ours) keeps fiber ends, D, d and simultaneous steps, and changes what keeps line 2 from ending:

 R1  the elbow solution that can be had in time, on the same side     `run.Descent`, `retract_profile.by_way_of_home`
 R2  attraction acts on the joints: phi bends towards home, theta     `retract_profile.heading`
       turns there, and the arm comes out when it is due
 R3  before anything moves all motions are rehearsed without          `rehearsal.take_turns`
       repulsion; of two that would meet, one varies when it
       leaves, when it arrives or on which side it passes its base
 R4  repulsion pulls nothing: from the step that attraction asks for  `repaired.descend_repaired`
       it takes what would use up more than half of x - d
 R5  of two in each other's path, the one of lower rank makes room    `yielding.keep_order`
 R6  those that are still stuck get a joint path at the end           `run.Descent.finished`,
                                                                        `planners.shared.joint_paths`

In both modes a step is granted whole, in part or not at all, as far as the true bodies are proven clear through it
(`planners.shared.safe_steps`), and steps are recorded as few knots (`planners.shared.recording`). `run.Descent` owns
the arrays of one run; `planner.NavigationFunction` has the settings, and says in its notes what the weights cannot
promise (`planners.shared.repulsion.theorem1_bound`). Measurements: ``design/navigation-function.md``.
"""

from fiberplan.planners.navigation_function.planner import NavigationFunction

__all__ = ["NavigationFunction"]
