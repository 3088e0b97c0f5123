"""Makarem2016: the field of elongated zones, on its own array, on MOONS' cases and on Sayres2021's array.

Every field is planned twice, by the field alone and with relief; every motion is judged by `verify`.
"""

from pathlib import Path

from fiberplan.reproductions.makarem2016 import arrays, conflict, moons
from fiberplan.reproductions.rows import Row, Shown

LEGEND = """\
alone: the field; relief: the field, then rounds of relief; both with the settings EllipticNavigationFunction has by
default, the same for every row. Trial k uses seed k; +- is the standard deviation over trials. Times to compute are
CPU time of one core, kernels compiled. MOONS: n is how many have targets; a few of those touch at rest under the zones
as we read them, and count as not arrived. A motion may take 600 s here; the prototype's took 52.5 s. A buffer of b mm
is a margin of 2 (b - 1.5) mm."""


FIGURES = {
    "arrivals.png": Shown(
        "Figs. 4 and 5: assigned and arrived of 1025 positioners", ("uniform targets", "clustered targets")
    ),
    "conflict.png": Shown(
        "Tips and necks are at two heights: one of five leaves its target to let another pass, six moments",
        ("positioners: arrived", "positioners: contacts"),
    ),
    "distances.png": Shown("How far the five are from their targets", ("five positioners:",)),
    "moons.png": Shown("Share of targets reached in MOONS' own cases", ("MOONS",)),
}


def run(trials: int, folder: Path | None = None) -> list[Row]:
    """Run all experiments, `trials` fields each; figures go into `folder`, which must exist."""
    arrays.warm_up()
    own = arrays.on_its_own_array(trials)
    scene = conflict.five()
    cases = moons.cases()
    sdss = arrays.on_sayres2021(max(1, trials // 4))
    if folder is not None:
        from fiberplan.reproductions.makarem2016 import figures  # matplotlib takes a while to import

        figures.arrivals(own, folder / "arrivals.png")
        figures.conflict(scene, folder / "conflict.png")
        figures.distances(scene, folder / "distances.png")
        if cases:
            figures.moons(cases, folder / "moons.png")
    return [
        *arrays.own_rows(own),
        *conflict.rows(scene),
        *conflict.two_arms(trials),
        *moons.rows(cases),
        *arrays.sayres_rows(sdss),
    ]
