"""What Makarem2014 reports, and the sizes at which it is asked again. Nothing here is ours."""

LONGEST_RUN = 140.0  #: Fig. 5, 5000 positioners [s]
RUN_TIME: dict[int, float | str] = {
    4921: LONGEST_RUN,
    2437: "< 60",
}  #: Fig. 5: positioners (5000 and 2400 there) -> computing time [s]
RUN_TIME_GROWTH = 1.0  #: Fig. 5: computing time is linear in the number of positioners
MOTION_TIME = "about 2.5"  #: Fig. 6 [s], whatever the number of positioners
CONVERGED = 1.0  #: share of fibers that converge, in 4100 runs
CONTACTS = 0.0  #: in these runs
THEOREM_1 = "72"  #: the bound as printed, whose unit is not said
WEIGHTS = 20.0  #: lambda1 / lambda2 of the simulations, Table 4
SPEEDS = (180.0, 120.0)  #: largest of theta and phi, 30 and 20 rpm, Table 3 [deg/s]
SPACING = 2.0  #: safety distance d [mm]
