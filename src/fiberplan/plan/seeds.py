"""Which seeds there are: whole numbers that every generator takes, in compiled code too."""

import operator
from typing import Any

MOST_SEED = 2**63 - 1


def seed_complaint(seed: Any) -> str | None:
    """What is wrong with a seed, or None."""
    try:
        if not isinstance(seed, bool) and 0 <= operator.index(seed) <= MOST_SEED:
            return None
    except TypeError:
        pass
    return f"seed must be a whole number from 0 to {MOST_SEED}, got {seed!r}"
