"""Which seeds there are: whole numbers that every generator takes, in compiled code too."""

import operator
from typing import Any

import numpy as np

from fiberplan.errors import ProblemError

MOST_SEED = 2**63 - 1


def _is_seed(seed: Any, most: float) -> bool:
    """Whether it is a whole number from 0 to `most`."""
    try:
        return not isinstance(seed, bool) and 0 <= operator.index(seed) <= most
    except TypeError:
        return False


def seed_complaint(seed: Any) -> str | None:
    """What is wrong with a seed, or None."""
    return None if _is_seed(seed, MOST_SEED) else f"seed must be a whole number from 0 to {MOST_SEED}, got {seed!r}"


def generator(seed: Any) -> np.random.Generator:
    """What draws a made-up field: the same for the same seed, which may be of any size here.

    Raises:
        ProblemError: a seed that is no whole number of 0 or more.
    """
    if not _is_seed(seed, np.inf):
        raise ProblemError(f"seed must be a whole number of 0 or more, got {seed!r}")
    return np.random.default_rng(seed)
