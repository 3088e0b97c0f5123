"""Sabater2018, section 5: assignment plans of twelve probe arms, from park and one after the other.

Link lengths and targets are ours, since the paper prints neither; so everything is repeated with each length changed.
"""

from pathlib import Path

from fiberplan.focal_plane import FocalPlane
from fiberplan.reproductions.rows import Row, Shown
from fiberplan.reproductions.sabater2018 import published, tables
from fiberplan.reproductions.sabater2018.case import detailed
from fiberplan.reproductions.sabater2018.trials import CONTINUOUS, PAPER, REPLANNING, fields
from fiberplan.reproductions.sabater2018.trials import run as plan_all
from fiberplan.reproductions.sabater2018.variations import CHANGES, LENGTHS, varied

LEGEND = """\
One pass: the paper's planner, one priority order, collision steps of 100 ms; replanning: twelve orders and private
garages; continuous: one pass, checked as rarely as the motion bound allows. Plan k has the targets of seed 1000 + k,
12 of them, uniform in the field and 25 mm apart; chained plans begin where the one before was to end. The link lengths
of the arms are chosen, not published. The paper's "median" of 102.55 s cannot be one of multiples of 6 s, so both
median and mean stand beside it. Computing is CPU time on one core with kernels compiled; the paper's is of a 3.2 GHz
i5. Pair checks are counted as there: each other arm, each 100 ms. Figs. 11 to 13 are drawn as we read them."""

FIRST_SEED = 1000  #: of the plans; lengths and radii were chosen on others


FIGURES = {
    "fig11.png": Shown("Fig. 11: configuration times from park, one pass", ("from park, one pass:",)),
    "fig12.png": Shown("Fig. 12: configuration times of chained plans, one pass", ("chained, one pass:",)),
    "fig13.png": Shown("Fig. 13: the detailed case at its start, half way and at its end", ("detailed case:",)),
}


def run(trials: int, folder: Path | None = None) -> list[Row]:
    """Run all experiments with `trials` plans each (the paper has 200); figures go into `folder`, which must exist."""
    plane = FocalPlane.load("miradas")
    goals = fields(plane, range(FIRST_SEED, FIRST_SEED + trials + 1))
    for planner in (PAPER, CONTINUOUS):
        plan_all(plane, goals[:1], planner, chained=False)  # compiles the kernels
    park = plan_all(plane, goals[:-1], PAPER, chained=False)
    chained = plan_all(plane, goals, PAPER, chained=True)
    found = detailed(plane, goals[:-1], PAPER)
    rows = [
        *tables.plans("from park, one pass", park, published.SOLVED_FROM_PARK, published.TIME_FROM_PARK),
        *tables.plans("chained, one pass", chained, published.SOLVED_CHAINED, published.TIME_CHAINED),
    ]
    for name, planner in (("replanning", REPLANNING), ("continuous", CONTINUOUS)):
        rows += tables.plans(f"from park, {name}", plan_all(plane, goals[:-1], planner, chained=False), None, None)
        rows += tables.plans(f"chained, {name}", plan_all(plane, goals, planner, chained=True), None, None)
    rows += tables.case(found)
    for which in LENGTHS:
        for change in CHANGES:
            other = varied(plane, which, change)
            some = fields(other, range(FIRST_SEED, FIRST_SEED + max(1, trials // 4) + 1))
            rows += tables.variation(
                f"{LENGTHS[which]} {change:+.0%}",
                plan_all(other, some[:-1], PAPER, chained=False),
                plan_all(other, some, PAPER, chained=True),
            )
    if folder is not None:
        from fiberplan.reproductions.sabater2018 import figures  # matplotlib takes a while to import

        figures.times(park, "Fig. 11: plans from park, one pass", published.TIME_FROM_PARK[1], folder / "fig11.png")
        figures.times(chained, "Fig. 12: chained plans, one pass", published.TIME_CHAINED[1], folder / "fig12.png")
        figures.snapshots(found.plan, folder / "fig13.png")
    return rows
