"""What Sayres2021 reports, as text for a row and as numbers for a figure. Nothing here is ours.

The figures are of the pre-publication draft. A collision buffer there is the half-width of an arm; the array has arms
of radius 1.5 mm, so a buffer is a margin of twice what it adds to that.
"""

import math

RADIUS = 1.5  #: of the arm when no margin is kept [mm]
COLLAPSE = 2.25  #: buffer past which folding fails [mm]

REACHED = "typically any point"  #: Fig. 4: by three or more (abstract)
TOUCHED = "6 in the text"  #: Fig. 7: neighbours of a positioner
RUN_TIME = {1.0: 0.2, 0.01: 40.0}  #: Fig. 11: step [deg] -> time of a fold [s]
FOLDED = 0.997  #: Fig. 12: more than this share folds at buffers below ...
FOLDED_BELOW = 2.0  #: ... this [mm]
DEADLOCK = 0.2  #: Fig. 14: deadlock chance is below this near a buffer of 1.5 mm
REPLACEMENTS = {"below": 1.0, "above": 10.0}  #: Fig. 15: per deadlocked trial, by regime
NEEDED = 0.34  #: Fig. 15: share of trials that needed any, below the collapse
LOST = {"below": 0.0006, "above": 0.02}  #: Fig. 15: share of targets lost, by regime
FOLD_TIME = (13.0, 1.0)  #: Fig. 16: mean and spread [s]
MOVE_TIME = (26.0, 2.0)  #: Fig. 16: target to folded to target [s]


def run_time(step: float) -> float | None:
    """Fig. 11 [s], at a step [rad]."""
    return RUN_TIME.get(round(math.degrees(step), 9))


def margin(buffer: float) -> float:
    """Clearance between arms [mm] that a buffer [mm] in the paper's sense asks for."""
    return 2.0 * (buffer - RADIUS)


def regime(buffer: float) -> str:
    """Which side of the collapse a buffer [mm] is on."""
    return "below" if buffer < COLLAPSE else "above"


def folded(buffer: float) -> str | None:
    """Fig. 12."""
    if buffer < FOLDED_BELOW:
        return f"> {FOLDED:g}"
    return "falls sharply" if buffer > COLLAPSE else None


def deadlock(buffer: float) -> str | float | None:
    """Fig. 14."""
    if buffer > COLLAPSE:
        return 1.0
    return f"< {DEADLOCK:g}" if buffer == RADIUS else None
