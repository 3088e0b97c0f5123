"""EllipticNavigationFunction: Makarem2016's field for arms with collision zones at several heights, line by line.

Symbols: q_i the fiber of positioner i, q_iT its target; zones are ellipses along the arm, and x is the weighted
distance of two zones' centres, which maps the ellipses to circles: d where they touch, D where repulsion begins.
The potential is (Eq. 7)

    psi_i = lambda1 |q_i - q_iT| + sum over pairs of zones that meet of lambda max(0, (D^2 - x^2) / (x^2 - d^2)),

lambda being lambda2 for zones in the outer half of the arm and lambda3 for the others. Printed, the repulsion has the
sign slip of Makarem2014, Eq. 8 lacks its minus, and q_i stands where the zones' centres belong; all three are mended.

Paper                                                                 here
---------------------------------------------------------------------------------------------------------------------
 1  zones, each with a height: one ellipse for each body              `zones.elliptic_zones`
 2  zones of different size for each positioner, fixed beforehand:    `run.assigned_sizes`: the larger the priority, the
      the one with the smaller zone goes first                          smaller the zone; field `spread`
 3  repeat until all have arrived                                     `descent.descend`, `run.Drive.by_the_field`
 4    for each i, from the positions at the beginning of the step:    `descent._ask`
 5      pull of constant strength to the goal
 6      push of each pair of zones that meet            (Eqs. 7, 8)   `descent._pushed_by`, `field.zone_push`,
                                                                        `planners.shared.repulsion`
 7      joint speeds = J^T of that, within the limits                 `field.zone_push`, `planners.shared.step_limits`
 8    all move                                                        `descent._decide`, `descent._go`

What differs, and why: line 5 pulls the joints, not the fiber, because targets come with an elbow solution and a fiber
cannot tell the two apart. Line 6 fades while a neighbour comes no nearer to its aim, to nothing after `stall_time`
seconds, and for two that are both within `near` seconds of their goals; without that, positioners at rest hold others
off free goals. Line 7 lets the weights turn with the arm. Line 8 grants a step only as far as it is proven clear
(`planners.shared.safe_steps`), so a positioner that does not arrive stays where it stands.

Relief of deadlocks (``relief="layers"``) after the idea of Tao2018; states and rules are ours:

 9  repeat: some of the stalled lead, no two of them neighbours       `run.Drive.with_relief`, `relief.Relief.begin`
10    a leader retreats, then goes; those that refuse it go away      `relief.Relief.look`
        and come back; all others rest
11    groups that gained nothing are put back, their motion struck    `run.Drive._strike_out`
        out
12  rounds that have nothing to do with each other run at once       `compaction.closed_up`

`planner.EllipticNavigationFunction` has the settings, outcomes and notes; `planners.shared.recording` makes few knots
of the steps. Measurements: ``design/elliptic-field.md``.
"""

from fiberplan.planners.elliptic_navigation.planner import EllipticNavigationFunction

__all__ = ["EllipticNavigationFunction"]
