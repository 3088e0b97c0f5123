"""Makarem2014, section 4: fields of 7 to 5000 positioners, and a conflict of three.

Every experiment runs under three rules (see `fiberplan.reproductions.makarem2014.rules`), on the same seeded fields.
"""

import json
from dataclasses import asdict
from pathlib import Path

from fiberplan.reproductions.makarem2014 import tables
from fiberplan.reproductions.makarem2014.conflict import Conflict
from fiberplan.reproductions.makarem2014.few_bits import quantized
from fiberplan.reproductions.makarem2014.rules import LITERAL, RULES
from fiberplan.reproductions.makarem2014.scenes import FIG7_SEED
from fiberplan.reproductions.makarem2014.trials import run_clustered, run_uniform
from fiberplan.reproductions.rows import Row, Shown

LEGEND = """\
literal: the printed field, the sign of its repulsion mended, joints without limits as in the paper; limited: so,
within alpha 0 to 360 and beta -180 to 180 deg; repaired: within these limits, with turns taken and goals left in
peace by repulsion. In all, a step is granted as far as it is proven clear. Fields are uniform, from one to another,
seeds 2 k and 2 k + 1 in trial k; clustered ones are a chain. Motion time is that until the last fiber that converges
stays within 100 um. Times are CPU time, kernels compiled; the paper's are of a 3.33 GHz six-core Xeon. With -o,
failures.json lists who was left behind, by seed."""

RINGS = [1, 2, 3, 5, 8, 12, 18, 24, 28, 40]  #: 7 to 4921 positioners
CLUSTERED_RINGS = 12  #: 469 positioners
SPACED_RINGS = 8  #: 217 positioners
SPACED = 4.0  #: D: goals at least this far apart do not repel each other [mm]
BITS = (3, 4, 6)


FIGURES = {
    "fig5.png": Shown("Fig. 5: computing time against the number of positioners", ("Fig. 5:",)),
    "fig6.png": Shown("Fig. 6: motion time against the number of positioners", ("Fig. 6:",)),
    "fig7.png": Shown("Fig. 7: three positioners in a conflict, six moments", ("Fig. 7:",)),
    "fig8.png": Shown("Fig. 8: joint speeds in that conflict", ("Fig. 8:",)),
}


def run(trials: int, folder: Path | None = None, rings: list[int] | None = None) -> list[Row]:
    """Run all experiments with `trials` fields each; figures and failures go into `folder`, which must exist.

    `rings` are the sizes of Figs. 5 and 6, those of the paper unless given.
    """
    for rule in RULES:
        run_uniform([1], 1, rules=(rule,))  # compiles the kernels
    runs = run_uniform(rings or RINGS, trials)
    chain = run_clustered(CLUSTERED_RINGS, trials)
    near = run_uniform([SPACED_RINGS], trials, rules=(LITERAL,))
    far = run_uniform([SPACED_RINGS], trials, SPACED - 2.0, rules=(LITERAL,))
    fig7 = Conflict.of(FIG7_SEED)
    bits = quantized(SPACED_RINGS, BITS, max(1, trials // 4))
    if folder is not None:
        from fiberplan.reproductions.makarem2014 import figures  # matplotlib takes a while to import

        figures.fig5(runs, folder / "fig5.png")
        figures.fig6(runs, folder / "fig6.png")
        figures.fig7(fig7, folder / "fig7.png")
        figures.fig8(fig7, folder / "fig8.png")
        left = [asdict(failure) for failure in (*runs.failures, *chain.failures)]
        (folder / "failures.json").write_text(json.dumps(left, indent=1))
    return [
        *tables.run_times(runs),
        *tables.motion_times(runs),
        *tables.conflict(fig7),
        *tables.arrivals(runs, "uniform"),
        *tables.arrivals(chain, "chained clustered"),
        *tables.spacing(near, far, SPACED),
        *tables.few_bits(bits),
        *tables.theorem(LITERAL.planner.lambda1 / LITERAL.planner.lambda2),
    ]
