"""What Sabater2018 reports. Nothing here is ours."""

SOLVED_FROM_PARK = 0.97  #: share of 200 plans solved in one pass, in under 120 s
SOLVED_CHAINED = 0.93  #: share of 200 plans, each from the end of the one before
TIME_FROM_PARK = (96.0, 102.55, 114.0)  #: least, "median" and greatest configuration time [s]
TIME_CHAINED = (None, 90.6, 108.0)  #: [s]
COMPUTING = 16.14  #: of the detailed case, on a 3.2 GHz i5 [s]
CHECKS = 75_684.0  #: pair checks of the detailed case
PATHS = "32-34"  #: in each roadmap of the detailed case, after filtering
LONGEST = 19.0  #: steps of 6 s of its longest arm
STOPS = "<= 1"  #: start-stops of any arm
