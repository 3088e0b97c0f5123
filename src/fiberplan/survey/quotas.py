"""Required numbers of positions of a category, such as sky and standards, spread over regions of the focal plane."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fiberplan.arrays import Frozen, read_only
from fiberplan.errors import ProblemError
from fiberplan.focal_plane import FocalPlane
from fiberplan.survey.catalogue import Catalogue


@dataclass(frozen=True, eq=False)
class Quotas(Frozen):
    """Groups of positions: a category in a region. A position counts for the region of the positioner that takes it."""

    categories: tuple[str, ...]  #: that positions are required of
    region: np.ndarray  #: (n,) of each positioner, from 0
    need: np.ndarray  #: (categories * regions,) how many are required, region by region of each category

    @classmethod
    def of(cls, plane: FocalPlane, required: Mapping[str, int] | None, regions: Any) -> "Quotas":
        """Required numbers shared out equally among regions, the first of which get what is left over.

        Args:
            plane: the array.
            required: category -> how many positions.
            regions: how many regions of equally many positioners each, or (n,) the region of each positioner, from 0.

        Raises:
            ProblemError: a number that is no whole number of 0 or more, or regions that make no sense.
        """
        required = dict(required or {})
        for name, count in required.items():
            if isinstance(count, bool) or not isinstance(count, int | np.integer) or count < 0:
                raise ProblemError(f"required: {name} must be a whole number of 0 or more, got {count!r}")
        if isinstance(regions, int | np.integer) and not isinstance(regions, bool):
            if not 1 <= regions <= plane.n:
                raise ProblemError(f"regions must be from 1 to {plane.n}, got {regions}")
            region, many = regions_of(plane, int(regions)), int(regions)
        else:
            region = read_only(regions, float, name="regions", error=ProblemError)
            if region.shape != (plane.n,) or (region < 0).any() or (region % 1 != 0).any():
                raise ProblemError(f"regions must be a number, or {plane.n} whole numbers from 0")
            many = int(region.max()) + 1
        need = [count // many + (k < count % many) for count in required.values() for k in range(many)]
        return cls(tuple(required), read_only(region, np.int64), read_only(need, np.int64))

    def group(self, catalogue: Catalogue, positioner: np.ndarray, target: np.ndarray) -> np.ndarray:
        """(m,) the group that positioners on these targets count for; -1: none."""
        place = {name: k for k, name in enumerate(self.categories)}
        assert catalogue.category is not None  # set on construction
        category = np.array([place.get(name, -1) for name in catalogue.category], np.int64)[target]
        width = max(1, len(self.need) // max(1, len(self.categories)))
        return np.where(category < 0, -1, category * width + self.region[positioner])

    def named(self, group: int) -> tuple[str, int]:
        """Category and region of a group."""
        width = len(self.need) // len(self.categories)
        return self.categories[group // width], group % width


def regions_of(plane: FocalPlane, count: int) -> np.ndarray:
    """(n,) of each positioner its region, from 0: the array is halved across its longer side until there are enough."""
    region = np.zeros(plane.n, np.int64)

    def halve(who: np.ndarray, many: int, first: int) -> None:
        region[who] = first
        if many == 1:
            return
        axis = int(np.argmax(np.ptp(plane.base[who], axis=0)))
        order = who[np.argsort(plane.base[who, axis], kind="stable")]
        cut = len(who) * (many // 2) // many
        halve(order[:cut], many // 2, first)
        halve(order[cut:], many - many // 2, first + many // 2)

    halve(np.arange(plane.n), count, 0)
    return region
