"""Proofs, of safety and of there being no path, that know nothing of planners, plans or problems.

- `safety`: `verify`, what it found (`Certificate`, `Contact`, `ZoneEntry`), and which pairs it has to look into
- `known`: what the proof of another motion says of this one, pair by pair
- `violations`: what motors cannot do: ranges, speeds, accelerations
- `bisection`: lower bounds of a pair's clearance over time, bisected until they are sharp
- `clocks`: the same where clocks are off, over all pairs of moments
- `reactions`: `stalls` and `reaction`: how soon the first contact is if one positioner stops dead while the rest go on
- `tolerated`: how much more a proven motion tolerates: clocks and arms that are off, stalls
- `opening`: `Opening`: pairs that begin nearer than the margin and only come apart
- `witnesses`: what shows each pair clear, as data that plan files carry
- `replay`: whether that data is true, by code that shares nothing with all of the above
- `replay_outcomes`: whether the other claims of a plan file are: limits, start, goals, outcomes
- `replay_geometry`: which geometry it is about, in words and as a digest
- `whole_replay`: both, on all cores, of a file or of what changed in it
- `guesses`: `needed_guesses`: whether a proof needs the place that somebody is taken to stand at
- `path`: a trajectory as the proof's kernels take it
- `touching`: contacts of many motions, and nothing else of them; `keeping`: whether each pair keeps a margin, yes or no
- `over_time`: `clearance_over_time`: how near each pair comes in each part of a motion
- `any_speed`: pairs that are clear wherever within their turns the joints are
- `unreachable`: `decided`: a path or a proof that there is none, for up to three positioners; `proven_unreachable` and
  `proven_excluded`; `subdivision`: boxes of their joint space; `box_search`: what to halve; `lost`: which such proof
  shows that a goal had to be lost; `replay_infeasible`: the replay of these from a plan file, with `replay_boxes` and
  `replay_contact`
- `least_time`: `proven_least_time`: a time that one or two positioners need at least; `cells`: of their joint space

Names are imported when they are first used, so that a replay needs no kernel.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fiberplan.certificates.guesses import needed_guesses
    from fiberplan.certificates.least_time import proven_least_time
    from fiberplan.certificates.opening import Opening
    from fiberplan.certificates.over_time import clearance_over_time
    from fiberplan.certificates.reactions import Stall, Stalls, reaction, stalls
    from fiberplan.certificates.safety import Certificate, Contact, ZoneEntry, verify
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
    "proven_least_time",
    "proven_unreachable",
    "reaction",
    "stalls",
    "verify",
]

_HOME = dict.fromkeys(("Certificate", "Contact", "ZoneEntry", "verify"), "safety")
_HOME |= dict.fromkeys(("proven_excluded", "proven_unreachable"), "unreachable")
_HOME |= dict.fromkeys(("Stall", "Stalls", "reaction", "stalls"), "reactions")
_HOME |= {
    "Opening": "opening",
    "Tolerated": "tolerated",
    "clearance_over_time": "over_time",
    "needed_guesses": "guesses",
    "proven_least_time": "least_time",
}


def __getattr__(name: str) -> Any:
    """Import a public name from its module the first time it is asked for."""
    if name not in _HOME:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    value = globals()[name] = getattr(importlib.import_module(f"{__name__}.{_HOME[name]}"), name)
    return value


def __dir__() -> list[str]:
    """Public names, imported or not."""
    return sorted(__all__)
