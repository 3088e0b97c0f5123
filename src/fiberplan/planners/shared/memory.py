"""Refuse what would not fit into memory before it is allocated."""

from fiberplan.errors import ProblemError

MOST_BYTES = 2 * 1024**3  #: that one planner may ask for at a time


def refuse_large(size: float, what: str) -> None:
    """Refuse arrays of more than `MOST_BYTES`.

    Args:
        size: of the arrays that are about to be made [bytes].
        what: needs them, with the figures that make them so large.

    Raises:
        ProblemError: they are larger than that.
    """
    if not size <= MOST_BYTES:
        gib = 1024**3
        raise ProblemError(f"{what}: that would take {size / gib:.3g} GiB, and {MOST_BYTES / gib:.3g} GiB are the most")
