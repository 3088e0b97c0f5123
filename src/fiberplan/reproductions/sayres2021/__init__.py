"""Sayres2021, section 4: folding random fields of 547 robots, and what it takes where that deadlocks.

Every experiment runs under three rules (see `fiberplan.reproductions.sayres2021.rules`), on the same seeded fields.
"""

from pathlib import Path

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.reproductions.rows import Row, Shown
from fiberplan.reproductions.sayres2021 import tables
from fiberplan.reproductions.sayres2021.relief import relieve
from fiberplan.reproductions.sayres2021.rules import CERTIFIED, RULES
from fiberplan.reproductions.sayres2021.trials import folds_at, forward, run_times, sweep

LEGEND = """\
literal: moves are tested where they end, as printed; sampled: so, but moves that change nothing are passed over;
certified: so, and moves are tested over the whole step, with 0.5 um to spare. Every motion is judged by `verify`.
A buffer of b mm is a margin of 2 (b - 1.5) mm; the step is 1 deg unless another is named; trial k uses seed k; +- is
the standard deviation over trials. Run times are CPU time, kernels compiled and neighbour lists made; the paper's are
of a 2.9 GHz Core i9."""

BUFFERS = [float(b) for b in np.linspace(1.5, 3.0, 10)]  #: [mm]
RELIEF_BUFFERS = [1.5, 2.0, 2.5, 3.0]  #: of Fig. 15 [mm]
FINE_BUFFERS = [1.5, 2.0]  #: at which a finer step is tried too [mm]
STEP, FINE_STEP = np.radians(1.0), np.radians(0.1)  #: [rad]
TIMED_STEPS = [float(s) for s in np.radians([1.0, 0.3, 0.1, 0.03, 0.01])]  #: [rad]
PATH_STEPS = [TIMED_STEPS[0], TIMED_STEPS[-1]]  #: of Fig. 10 [rad]


FIGURES = {
    "fig4.png": Shown("Fig. 4: by how many fibers each point is reached", ("Fig. 4:",)),
    "fig7.png": Shown("Fig. 7: with how many others each positioner can come into contact", ("Fig. 7:",)),
    "fig10.png": Shown("Fig. 10: one positioner's path from its target to folded, at two steps", ("Fig. 10:",)),
    "fig11.png": Shown("Fig. 11: run time of a fold against the step", ("Fig. 11:",)),
    "fig12.png": Shown("Fig. 12: share of positioners that fold against the buffer", ("Fig. 12:",)),
    "fig14.png": Shown("Fig. 14: chance that a trial deadlocks against the buffer", ("Fig. 14:",)),
    "fig15.png": Shown("Fig. 15: how many replacements resolve a deadlocked trial", ("Fig. 15:",)),
    "fig16.png": Shown("Fig. 16: fold time, and time from target to target, against the buffer", ("Fig. 16:",)),
}


def run(trials: int, folder: Path | None = None) -> list[Row]:
    """Run all experiments with `trials` random fields each; figures go into `folder`, which must exist."""
    plane = FocalPlane.load("sayres2021")
    sweep(plane, BUFFERS[:1], STEP, 1)  # compiles the kernels
    paths = folds_at(plane, CERTIFIED, PATH_STEPS)
    times = run_times(plane, TIMED_STEPS, max(1, trials // 4))
    coarse = sweep(plane, BUFFERS, STEP, trials)
    fine = sweep(plane, FINE_BUFFERS, FINE_STEP, trials)
    reliefs = relieve(plane, RELIEF_BUFFERS, STEP, trials)
    arrived = {rule: forward(plane, rule, STEP, trials) for rule in RULES}
    if folder is not None:
        from fiberplan.reproductions.sayres2021 import figures  # matplotlib takes a while to import

        figures.fig4(plane, folder / "fig4.png")
        figures.fig7(plane, folder / "fig7.png")
        figures.fig10(plane, paths, PATH_STEPS, folder / "fig10.png")
        figures.fig11(times, folder / "fig11.png")
        figures.fig12(coarse, folder / "fig12.png")
        figures.fig14(coarse, fine, folder / "fig14.png")
        figures.fig15(reliefs, folder / "fig15.png")
        figures.fig16(coarse, reliefs, folder / "fig16.png")
    return [
        *tables.workspaces(plane),
        *tables.paths(plane, paths, PATH_STEPS),
        *tables.run_times(times),
        *tables.folded(coarse),
        *tables.deadlocks(coarse, STEP),
        *tables.deadlocks(fine, FINE_STEP),
        *tables.replacements(reliefs),
        *tables.fold_times(coarse, reliefs),
        *tables.forward(arrived),
        *tables.contacts(coarse, STEP),
        *tables.contacts(fine, FINE_STEP),
    ]
