"""A made-up survey: targets clustered on the sky, in classes, and the fields that observe them.

As in `clustered`, clusters are a Thomas process over a thinner uniform sky. Classes are rare and wanted, ordinary, or
many; sky positions and standards are everywhere. Made up, and the same for the same seed.
"""

from typing import NamedTuple

import numpy as np
from astropy.table import QTable

from fiberplan.arrays.seeds import generator

_PER_CLUSTER = 30.0  # mean members of a cluster
_SPREAD = 0.05  # of the radius of a field: standard deviation of a cluster
_CLUSTERED = 0.6  # part of the targets in clusters
_STEP = 0.8  # of the radius of a field, from field to field: neighbours share targets
_CENTRE = np.radians([150.0, 2.0])  # right ascension and declination of the middle of the survey
_YEAR = 2027.5  # of the first field
_PER_NIGHT = 10  # fields of a chain


class _Class(NamedTuple):
    """A class of targets."""

    name: str
    share: float  #: of all targets
    priority: float
    tier: int
    proper_motion: float  #: [mas/yr] standard deviation of each component


_CLASSES = (
    _Class("quasar", 0.05, 10.0, 1, 0.0),
    _Class("galaxy", 0.45, 3.0, 2, 0.0),
    _Class("star", 0.30, 1.0, 2, 8.0),
    _Class("sky", 0.15, 1.0, 2, 0.0),
    _Class("standard", 0.05, 1.0, 2, 8.0),
)


def clustered_sky(
    fields: int, radius: float, per_field: float, seed: int = 0, regions: int = 1
) -> tuple[QTable, QTable]:
    """A catalogue and fields, as tables that `fiberplan.survey.run` takes.

    Args:
        fields: how many; they overlap, in rows of a square, ten of them a chain.
        radius: of a field [rad].
        per_field: mean number of targets in it, sky positions and standards included.
        seed: of the sky; the same seed gives the same tables.
        regions: squares beside each other that share no target; chains take turns at them.

    Raises:
        ProblemError: a seed that is none.
    """
    rng = generator(seed)
    night, within = np.divmod(np.arange(fields), _PER_NIGHT)
    region, number = night % regions, night // regions * _PER_NIGHT + within
    side = int(np.ceil(np.sqrt(number.max() + 1)))
    half = radius * (1 + _STEP * (side - 1) / 2)
    middle = np.stack([(np.arange(regions) - (regions - 1) / 2) * (2 * half + radius), np.zeros(regions)], axis=1)
    places = np.concatenate([each + _clustered(rng, half, radius, per_field) for each in middle])
    which = rng.choice(len(_CLASSES), len(places), p=[kind.share for kind in _CLASSES])
    motion = rng.normal(size=places.shape) * np.array([kind.proper_motion for kind in _CLASSES])[which][:, None]
    catalogue = QTable()
    catalogue["id"] = [f"T{k:06d}" for k in range(len(places))]
    catalogue["ra"], catalogue["dec"] = _sky(places)
    catalogue["pm_ra"], catalogue["pm_dec"] = np.round(motion.T, 3)
    catalogue["priority"] = [_CLASSES[k].priority for k in which]
    catalogue["tier"] = [_CLASSES[k].tier for k in which]
    catalogue["category"] = [_CLASSES[k].name for k in which]
    catalogue["visits"] = np.where(which == 0, 2, 1)  # quasars twice
    rows, columns = np.divmod(number, side)
    columns = np.where(rows % 2, side - 1 - columns, columns)  # to and fro, so that neighbours follow each other
    centres = middle[region] + (np.stack([columns, rows], axis=1) - (side - 1) / 2) * _STEP * radius
    listed = QTable()
    listed["id"] = [f"F{k:04d}" for k in range(fields)]
    listed["ra"], listed["dec"] = _sky(centres)
    listed["year"] = np.round(_YEAR + 0.02 * night, 2)
    listed["chain"] = [f"night{k + 1}" for k in night]
    for table in (catalogue, listed):
        for name in ("ra", "dec"):
            table[name].unit = "deg"
    for name in ("pm_ra", "pm_dec"):
        catalogue[name].unit = "mas / yr"
    listed["year"].unit = "yr"
    return catalogue, listed


def _clustered(rng: np.random.Generator, half: float, radius: float, per_field: float) -> np.ndarray:
    """Targets (m, 2) [rad] in a square of so much to each side of its middle."""
    count = per_field * (2 * half) ** 2 / (np.pi * radius**2)
    centres = rng.uniform(-half, half, (rng.poisson(count * _CLUSTERED / _PER_CLUSTER), 2))
    members = np.repeat(centres, rng.poisson(_PER_CLUSTER, len(centres)), axis=0)
    clustered = members + rng.normal(scale=_SPREAD * radius, size=members.shape)
    return np.concatenate([clustered, rng.uniform(-half, half, (rng.poisson(count * (1 - _CLUSTERED)), 2))])


def _sky(offsets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Right ascension and declination [deg] of offsets (k, 2) east and north of the survey's middle [rad]."""
    dec = _CENTRE[1] + offsets[:, 1]
    ra = _CENTRE[0] + offsets[:, 0] / np.cos(dec)
    return np.round(np.degrees(ra), 7), np.round(np.degrees(dec), 7)
