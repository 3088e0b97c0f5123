"""One line of a comparison: what the paper says, and what was measured in this run."""

from collections.abc import Sequence
from typing import NamedTuple, TypedDict

import numpy as np


class Row(TypedDict):
    """Only `paper` is copied from anywhere; all other numbers come from this run."""

    quantity: str
    paper: str | float | None  #: value or text of the paper; None if it gives none
    ours: float | None  #: None if nothing could be measured
    spread: float | None  #: standard deviation over the trials, where that means something
    n: int  #: over how many trials


class Shown(NamedTuple):
    """What a figure shows, and which rows belong beside it."""

    caption: str
    rows: tuple[str, ...]  #: words: rows whose quantity has any of them belong to it


def paper_in_words(row: Row) -> str:
    """The paper's value."""
    published = row["paper"]
    return "" if published is None else f"{published:g}" if isinstance(published, float) else str(published)


def ours_in_words(row: Row) -> str:
    """Our value, with its spread where it has one."""
    if row["ours"] is None:
        return "none"
    spread = "" if row["spread"] is None else f" +- {row['spread']:.2g}"
    return f"{row['ours']:.4g}{spread}"


def value(quantity: str, paper: str | float | None, ours: float | np.floating | None, n: int) -> Row:
    """A single number."""
    return Row(quantity=quantity, paper=paper, ours=None if ours is None else float(ours), spread=None, n=n)


def mean(quantity: str, paper: str | float | None, values: Sequence[float] | np.ndarray) -> Row:
    """Mean and standard deviation of what the trials gave."""
    row = value(quantity, paper, float(np.mean(values)) if len(values) else None, len(values))
    if len(values) > 1:
        row["spread"] = float(np.std(values, ddof=1))
    return row


def share(quantity: str, paper: str | float | None, hits: Sequence[bool] | np.ndarray) -> Row:
    """How many of the trials it happened in."""
    return value(quantity, paper, float(np.mean(hits)) if len(hits) else None, len(hits))
