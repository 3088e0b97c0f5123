"""Direct: from any safe configuration straight to any other, by local search with soft conflicts (ours), line by line.

Symbols: K steps of tau seconds; for each positioner a lattice of alpha nodes a, beta nodes b and steps k, on which one
step turns a joint by a node or a few (its pace), at full speed; w_p the weight of a pair p of neighbours (1 at first);
C the pairs in contact. The ideas are those of MAPF-LNS2 (Li et al. 2022: repair by soft conflicts) and of breakout
(Morris 1993: a conflict that persists grows heavier). A set of beta nodes is one machine word. Where several
configurations reach a target, `goals.goals_in_time` has chosen one: the quickest that touches no other goal.

Algorithm                                                             here
---------------------------------------------------------------------------------------------------------------------
 1  K tau = the largest joint travel over its speed; a lattice for    `paths.Paths`, `lattice.make_lattice`,
      each positioner through its goal, its start one more node         `nodes.step_length`, `extents`
 2  K = what any positioner needs past arms that never move, on a     `narrow.steps_past_fixed`,
      finer lattice or on a way of its own where the first is too       `past_fixed.steps_past_fixed`,
      coarse; if that is more than allowed, another configuration       `passages.way_past_fixed`,
      that counts as its goal is tried, then the goal is given up,      `narrow.goes_elsewhere`,
      and those that leave it no place where it is shut in              `narrow.crowding_out`
 3  each positioner on its cheapest path, as if alone                 `repair.place_each`
 4  C = pairs in contact, in continuous time                          `contacts.find_contacts`
 5  until C is empty:                                                 `search.DirectSearch.run`, `repair.repair`
 6    p = a random pair of C; i, j = its arms, in random order
 7    if p has been tried more than 8 times: paths of i and j         `repair._join`, `pairs.move_jointly`: all joint
        jointly, clear of each other and of the others; then of         nodes (a, b, a', b') that can be reached after
        fewer and fewer of those that could make room                   each step (`joint_nodes`, kept in `scratch`)
 8      if there are none: K = what i and j need with nobody else     `pairs.steps_alone` (the pair bound, an estimate),
          there; if that is more than allowed, one goal is given up     `search.DirectSearch._lengthen_for`
 9    else path of i = the one of least sum over k of                 `single.replan`: dynamic programming over
        [ w_q for every neighbour in contact at k (pair q),             (a, b, k); nodes in contact by
          a little for extension, a little for turning ]                `blocked_nodes.mark_blocked`, `remembered`
10    w_q += 1/2 for every pair q of i (or j) that still touches      `repair._update_contacts`
11    who still touches what never moves: finer lattices, a way       `narrow.eased`,
        of its own, off which it is taken where others get stuck        `paths.Paths.take_off_ways`,
        on it; the last two pairs of C: joint paths of them and of      `search.DirectSearch.attempt`,
        more and more around them, in as many steps                     `untangle.untangled`
12    if C gets no smaller in 100 replans: K grows by 3, 6, 9, ... %  `search.DirectSearch.run`,
        and clusters of 3 to 8 around pairs of C get joint paths, at  `untangle.untangled`: RRT-Connect, or
        the same time: by chance or by way of folded, with shortcuts  the fold hub of the few; `shortcuts`
13    if work or K is used up: clusters of 8 once; then the goals     `settling.settle`,
        of least total priority that have a part in all of C are        `problem.least_cover.least_loss`
        given up, and the search goes on; before that, another          `narrow.makes_room`
        configuration that counts as one of them is tried
14  while K is more than anyone is known to need: shortcuts of who    `improving.shorten`, `shortcuts.hurried`
      is late and of those that refuse it others; then half as much
      more, with late positioners replanned, and 5 to 11 again; back
      to the last solution where that gets stuck
15  with `min_reaction`: C also holds pairs of which one is where     `improving.react`,
      the other is up to so many steps earlier or later, and line 9     `contacts.late_contacts`,
      blocks such nodes; 5 to 14 again, without shortcuts               `blocked_nodes.mark_blocked`
16  knots where a joint changes its speed, then as few as provably    `trim.as_trajectory`,
      stay clear                                                        `planners.shared.straighten`
17  a loss is proven where speeds, or what never moves, forbid the    `losses.Losses`, `planner.Direct.plan`,
      goal, or it leaves one that is shut in no place, or two are in    `plan.loss_proofs`,
      each other's way; if any loss is unproven, the fold hub is        `certificates.lost`,
      planned too, and the plan of greater kept priority is returned    `planners.greedy_fold`

With a deadline, lines 1 to 13 are gone through twice: first on coarser lattices and with more time than is needed
(`first.first_search`), which is soon done; that plan is the one where the second search has no better by then.

Lines 4 and 10 test whole steps in continuous time; lines 7 and 9 see nodes only. So a contact that appears only
between nodes raises the clearance that line 9 asks for that pair by 0.1 mm, and a contact left by line 7 the clearance
that line 7 asks for by 0.05 mm.

The measurements behind each decision are in ``design/direct-planner.md``.
"""

from fiberplan.planners.direct.planner import Direct

__all__ = ["Direct"]
