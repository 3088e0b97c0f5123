"""Words of messages: names that were meant, and what other programs say, in one line."""

import difflib
from collections.abc import Iterable


def nearest(name: str, known: Iterable[str], cutoff: float = 0.5) -> str:
    """A question that suggests the closest known name, whatever its case, or nothing if none is close."""
    if is_number(name):
        return ""  # nobody misspells one number as another
    lower = {other.lower(): other for other in known}
    close = difflib.get_close_matches(name.lower(), list(lower), n=1, cutoff=cutoff)
    return f"; did you mean '{lower[close[0]]}'?" if close else ""


def one_line(text: object) -> str:
    """The first line of a message from elsewhere, at most 200 characters of it."""
    lines = [line.strip() for line in str(text).splitlines() if line.strip()]
    return lines[0][:200] if lines else type(text).__name__


def is_number(text: str) -> bool:
    """Whether a text is a number."""
    try:
        float(text)
    except ValueError:
        return False
    return True
