"""Proofs that goals cannot be reached, as tables: the regions of joint space that positioners cannot leave."""

import numpy as np
from astropy.io import fits

from fiberplan.certificates.unreachable import closed_region
from fiberplan.plan import Outcome, Plan
from fiberplan.tables.fits_tables import table_hdu


def regions_tables(plan: Plan) -> list[fits.BinTableHDU]:
    """CERTIFICATE_REGIONS, if of any that is said to be INFEASIBLE a region is found that it cannot leave.

    One region is enough if it holds none of the configurations that count as the goal; else there are more.
    """
    problem, owner, number, boxes = plan.problem, [], [], []
    for i in plan.having(Outcome.INFEASIBLE):
        ends = problem.goal[i, None]
        if problem.alternatives is not None:
            ends = np.concatenate([ends, problem.alternatives[i]])
        found: list[np.ndarray] = []
        for end in ends[~np.isnan(ends).any(axis=1)]:
            if not any(_outside(region, end) for region in found):
                region = closed_region(problem.plane, int(i), problem.start, end, problem.margin)
                found += [] if region is None else [region]
        for k, region in enumerate(found):
            owner.append(np.full(len(region), i))
            number.append(np.full(len(region), k))
            boxes.append(region.reshape(-1, 4))
    if not boxes:
        return []
    columns = {"positioner": np.concatenate(owner), "region": np.concatenate(number)}
    sides = dict(zip(("low_alpha", "high_alpha", "low_beta", "high_beta"), np.concatenate(boxes).T, strict=True))
    return [table_hdu("CERTIFICATE_REGIONS", columns | sides, dict.fromkeys(sides, "rad"))]


def _outside(region: np.ndarray, q: np.ndarray) -> bool:
    """Whether a configuration is in none of a region's boxes."""
    return not ((region[:, :, 0] <= q) & (q <= region[:, :, 1])).all(axis=1).any()
