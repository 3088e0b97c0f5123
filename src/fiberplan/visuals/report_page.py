"""What reports have in common: a page of headings, tables and pictures that needs no other file."""

import base64
import html
import os
from collections.abc import Iterable, Sequence
from typing import Any

from fiberplan.errors import FiberplanError
from fiberplan.tables.atomic import write_whole

_STYLE = """
:root { color-scheme: light dark; font: 15px/1.45 system-ui, sans-serif }
body { max-width: 76rem; margin: 2rem auto; padding: 0 1rem }
table { border-collapse: collapse; width: 100% }
th, td { text-align: left; padding: .3rem .7rem; border-bottom: 1px solid #8885; vertical-align: top }
td.number, th.number { text-align: right; font-variant-numeric: tabular-nums }
.safe { color: #1a7f37 } .unsafe { color: #c62828; font-weight: 600 }
li { margin: .15rem 0 } small { opacity: .75 } img { max-width: 100%; background: #fff }
"""


def write_page(title: str, verdict: str, good: bool, parts: Iterable[str], path: str | os.PathLike) -> None:
    """Write a page of a heading, a verdict and parts in HTML.

    Raises:
        FiberplanError: it cannot be written.
    """
    whole = [
        "<!doctype html><html lang='en'><meta charset='utf-8'>",
        "<meta name='viewport' content='width=device-width, initial-scale=1'>",
        f"<title>{text(title)}</title><style>{_STYLE}</style><body><h1>{text(title)}</h1>",
        f"<p class='{'safe' if good else 'unsafe'}'>{text(verdict)}</p>",
        *parts,
        "</body></html>\n",
    ]
    write_whole(path, "".join(whole).encode(), FiberplanError)


def table(heads: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """A table; columns whose first cell is a number stand to the right, and fractions have three digits."""
    listed = [list(row) for row in rows]
    first = listed[0] if listed else [""] * len(heads)
    kinds = ["number" if isinstance(cell, int | float) else "word" for cell in first]
    head = "".join(f"<th scope='col' class='{k}'>{text(name)}</th>" for k, name in zip(kinds, heads, strict=True))
    body = "".join(
        f"<tr>{''.join(f'<td class={k!r}>{text(shown(c))}</td>' for k, c in zip(kinds, row, strict=True))}</tr>"
        for row in listed
    )
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def picture(content: bytes, words: str) -> str:
    """A PNG, and what it shows in words."""
    coded = base64.b64encode(content).decode()
    return f"<p><img alt='{text(words)}' src='data:image/png;base64,{coded}'></p>"


def shown(value: Any) -> str:
    """A cell's value."""
    return f"{value:.3f}" if isinstance(value, float) else str(value)


def text(value: Any) -> str:
    """Escaped."""
    return html.escape(str(value))
