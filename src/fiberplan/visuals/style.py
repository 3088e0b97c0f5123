"""Colours and shapes shared by every figure and by the page, so that an outcome looks the same wherever it is seen.

Each colour has two values, for light and for dark backgrounds. Those of the outcomes stay apart for people with
protanopia and deuteranopia (tested), and what is lost is marked by shape as well, never by hue alone.
"""

from typing import NamedTuple

from fiberplan.plan import Outcome


class Colour(NamedTuple):
    """One colour, for either background."""

    light: str
    dark: str


OUTCOMES: dict[Outcome, Colour] = {
    Outcome.ARRIVED: Colour("#1272cd", "#63b3e8"),
    Outcome.DROPPED: Colour("#eeb800", "#fddf63"),
    Outcome.DEADLOCKED: Colour("#d85902", "#f37117"),
    Outcome.INFEASIBLE: Colour("#742d7e", "#ea4fc0"),
    Outcome.NO_TARGET: Colour("#a9b4bc", "#4f5c69"),
    Outcome.OFFLINE: Colour("#343b41", "#d2d7dc"),
}
"""In the order of a legend: what went well, what was lost, what had nothing to do."""

LABELS: dict[Outcome, str] = {
    Outcome.ARRIVED: "arrived",
    Outcome.DROPPED: "dropped",
    Outcome.DEADLOCKED: "deadlocked",
    Outcome.INFEASIBLE: "infeasible",
    Outcome.NO_TARGET: "no target",
    Outcome.OFFLINE: "offline",
}
LOST = (Outcome.DROPPED, Outcome.DEADLOCKED, Outcome.INFEASIBLE)

CONTACT = Colour("#bf0029", "#ff495f")
SAFE = Colour("#00785a", "#3ecf9f")
INK = Colour("#1b2430", "#e6ebf1")
MUTED = Colour("#5c6773", "#98a4b1")
LINE = Colour("#d5dbe1", "#2b3542")
PAPER = Colour("#ffffff", "#0e141b")
OBSTACLE = Colour("#cdb898", "#6a5a45")  # warm, so that it is told from arms without a target

RAMP: tuple[Colour, ...] = (
    Colour("#a3b8c6", "#41586a"),
    Colour("#6fa6c6", "#3f7898"),
    Colour("#3b8ec0", "#4d9fc4"),
    Colour("#2f68ad", "#74c3d6"),
    Colour("#5a3c98", "#aee2b0"),
    Colour("#851a72", "#f4ee8c"),
)
"""From little to much: darker on light backgrounds, lighter on dark ones, so that their order shows without hue."""

SERIES: tuple[str, ...] = ("#1272cd", "#d85902", "#00785a", "#742d7e", "#eeb800", "#5c6773")
"""Colours of curves on a light background, in order of use; the first is ours."""
PAPER_SERIES = MUTED.light  #: colour of published values, beside which ours are drawn


def css_name(outcome: Outcome) -> str:
    """The outcome's name in style sheets, "no-target" for instance."""
    return LABELS[outcome].replace(" ", "-")
