"""Proofs, of safety and of there being no path, that know nothing of planners, plans or problems.

- `safety`: `verify`, what it found (`Certificate`, `Contact`, `ZoneEntry`), and which pairs it has to look into
- `violations`: what motors cannot do: ranges, speeds, accelerations
- `bisection`: lower bounds of a pair's clearance over time, bisected until they are sharp
- `clocks`: the same where clocks are off, over all pairs of moments
- `stalls`: `stalls` and `reaction`: how soon the first contact is if one positioner stops dead while the rest go on
- `tolerated`: how much more a proven motion tolerates: clocks and arms that are off, stalls
- `opening`: `Opening`: pairs that begin nearer than the margin and only come apart
- `guesses`: `needed_guesses`: whether a proof needs the place that somebody is taken to stand at
- `path`: a trajectory as the proof's kernels take it
- `touching`: contacts of many motions, and nothing else of them
- `over_time`: `clearance_over_time`: how near each pair comes in each part of a motion
- `any_speed`: pairs that are clear wherever within their turns the joints are
- `unreachable`: `proven_unreachable` and `proven_excluded`, by flooding boxes of joint space; `tiling`: those boxes,
  and what they join; `replay_infeasible`: the replay of what these prove, from a plan file
"""

from fiberplan.certificates.guesses import needed_guesses
from fiberplan.certificates.opening import Opening
from fiberplan.certificates.over_time import clearance_over_time
from fiberplan.certificates.safety import Certificate, Contact, ZoneEntry, verify
from fiberplan.certificates.stalls import Stall, Stalls, reaction, stalls
from fiberplan.certificates.tolerated import Tolerated
from fiberplan.certificates.unreachable import proven_excluded, proven_unreachable

__all__ = [
    "Certificate",
    "Contact",
    "Opening",
    "Stall",
    "Stalls",
    "Tolerated",
    "ZoneEntry",
    "clearance_over_time",
    "needed_guesses",
    "proven_excluded",
    "proven_unreachable",
    "reaction",
    "stalls",
    "verify",
]
