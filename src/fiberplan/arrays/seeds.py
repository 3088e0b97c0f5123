"""Which seeds there are: whole numbers that every generator takes, in compiled code too."""

import operator
from typing import Any

import numpy as np

from fiberplan.errors import ProblemError

MOST_SEED = 2**63 - 1


def seed_complaint(seed: Any) -> str | None:
    """What is wrong with a seed, or None."""
    try:
        if not isinstance(seed, bool) and 0 <= operator.index(seed) <= MOST_SEED:
            return None
    except TypeError:
        pass
    return f"seed must be a whole number from 0 to {MOST_SEED}, got {seed!r}"


def generator(seed: Any) -> np.random.Generator:
    """What draws a made-up field: the same for the same seed, which may be of any size here.

    Raises:
        ProblemError: a seed that is no whole number of 0 or more.
    """
    try:
        if not isinstance(seed, bool) and operator.index(seed) >= 0:
            return np.random.default_rng(seed)
    except TypeError:
        pass
    raise ProblemError(f"seed must be a whole number of 0 or more, got {seed!r}")
