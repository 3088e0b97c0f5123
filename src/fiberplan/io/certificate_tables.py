"""Proofs that goals cannot be reached, as tables: boxes of joint space that positioners cannot leave."""

from collections.abc import Iterable

import numpy as np
from astropy.io import fits

from fiberplan.certificates.unreachable import Barrier
from fiberplan.plan import Outcome, Plan
from fiberplan.plan.loss_proofs import loss_proofs
from fiberplan.tables.fits_tables import table_hdu

WIDTH = 64  #: of a row of CERTIFICATE_TREES


def barrier_tables(plan: Plan) -> list[fits.BinTableHDU]:
    """CERTIFICATE_BARRIERS and CERTIFICATE_TREES, if of any that is said to be INFEASIBLE a proof is found."""
    arrived = plan.having(Outcome.ARRIVED).tolist()
    return proofs_as_tables(
        (i, barrier)
        for i in plan.having(Outcome.INFEASIBLE).tolist()
        for barrier in loss_proofs(plan.problem, i, arrived, plan.blockers.get(i, ()))
    )


def proofs_as_tables(proofs: Iterable[tuple[int, Barrier]]) -> list[fits.BinTableHDU]:
    """Both tables, of who is lost and what proves it; none if nothing does."""
    rows, trees = list[tuple](), list[str]()
    for i, barrier in proofs:
        for who in dict.fromkeys([*barrier.positioners, *barrier.goals]):
            goal = barrier.goals.get(who, (np.nan, np.nan))
            rows.append((len(trees), i, who, who in barrier.positioners, *goal))
        trees.append(barrier.tree)
    if not trees:
        return []
    number, lost, members, turns, alpha, beta = zip(*rows, strict=True)
    stated = {
        "barrier": np.array(number),
        "lost": np.array(lost),
        "positioner": np.array(members),
        "turns": np.array(turns),
        "goal_alpha": np.array(alpha),
        "goal_beta": np.array(beta),
    }
    cut = [(k, tree[at : at + WIDTH]) for k, tree in enumerate(trees) for at in range(0, len(tree), WIDTH)]
    boxes: dict = {"barrier": np.array([k for k, _ in cut]), "boxes": [text for _, text in cut]}
    return [
        table_hdu("CERTIFICATE_BARRIERS", stated, {"goal_alpha": "rad", "goal_beta": "rad"}),
        table_hdu("CERTIFICATE_TREES", boxes),
    ]
