"""One HTML page of published figures as they come out here, each beside the paper's numbers and ours.

A paper's package says in ``FIGURES`` which of its rows belong to which figure; what belongs to none comes below.
"""

import html
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from fiberplan import __version__
from fiberplan.errors import FiberplanError
from fiberplan.reproductions.rows import Row, Shown, ours_in_words, paper_in_words
from fiberplan.tables.atomic import write_whole
from fiberplan.visuals import style

_STYLE = (
    f"""
:root {{ color: {style.INK.light}; background: {style.PAPER.light} }}
a {{ color: #0b57d0 }}
@media (prefers-color-scheme: dark) {{
:root {{ color: {style.INK.dark}; background: {style.PAPER.dark} }}
a {{ color: #8ab4f8 }}
}}
"""
    + """
:root { color-scheme: light dark; font: 16px/1.5 system-ui, sans-serif }
body { max-width: 84rem; margin: 0 auto; padding: 1rem 1.2rem 4rem }
h2 { margin-top: 3rem; border-bottom: 2px solid #8888 }
section.figure { display: grid; grid-template-columns: repeat(2, minmax(20rem, 1fr)); gap: 1.5rem; margin: 2rem 0 }
@media (max-width: 60rem) { section.figure { grid-template-columns: 1fr } }
img { width: 100%; height: auto; background: #fff; border: 1px solid #8885 }
.rows { overflow: auto; max-height: 34rem }
table { border-collapse: collapse; width: 100%; font-size: .85rem }
th, td { padding: .2rem .5rem; border-bottom: 1px solid #8885; text-align: left; vertical-align: top }
tbody th { font-weight: 400 }
td { white-space: nowrap; font-variant-numeric: tabular-nums }
.legend { white-space: pre-line; max-width: 60rem }
"""
)


class Paper(NamedTuple):
    """A paper's experiments, run again."""

    key: str
    about: str  #: a line
    legend: str  #: what words in its rows mean
    figures: Mapping[str, Shown]  #: file name -> what it shows
    rows: Sequence[Row]
    folder: str  #: of its figures, as the page names it; "" for its own


def gallery(papers: Sequence[Paper], path: str | os.PathLike, trials: int) -> None:
    """Write the page.

    Args:
        papers: in order; figures that are not in their folders are left out.
        path: of the page.
        trials: how many a setting were run.

    Raises:
        FiberplanError: it cannot be written.
    """
    base = Path(path).parent
    parts = [
        "<!doctype html><html lang='en'><meta charset='utf-8'>",
        "<meta name='viewport' content='width=device-width, initial-scale=1'>",
        f"<title>Published figures, run again</title><style>{_STYLE}</style><body><main>",
        "<h1>Published figures, run again</h1>",
        f"<p>By fiberplan {_text(__version__)}, {trials} trials a setting. Only what stands under <i>paper</i> is "
        "copied; all else was computed in this run.</p>",
        "<nav><ul>",
        *(f"<li><a href='#{_text(paper.key)}'>{_text(paper.key)}</a>: {_text(paper.about)}</li>" for paper in papers),
        "</ul></nav>",
        *(part for paper in papers for part in _section(paper, base)),
        "</main></body></html>\n",
    ]
    write_whole(path, "".join(parts).encode("ascii", "xmlcharrefreplace"), FiberplanError)


def _section(paper: Paper, base: Path) -> list[str]:
    """A paper: its figures with their rows, then the rows of none."""
    left = list(paper.rows)
    parts = [f"<h2 id='{_text(paper.key)}'>{_text(paper.key)}</h2><p>{_text(paper.about)}</p>"]
    parts.append(f"<p class='legend'>{_text(paper.legend)}</p>")
    for name, shown in paper.figures.items():
        source = f"{paper.folder}/{name}" if paper.folder else name
        if not (base / source).is_file():
            continue
        mine = [row for row in left if any(words in row["quantity"] for words in shown.rows)]
        left = [row for row in left if row not in mine]
        parts.append(
            f"<section class='figure'><div><h3>{_text(shown.caption)}</h3>"
            f"<a href='{_text(source)}'><img src='{_text(source)}' alt='{_text(shown.caption)}'></a></div>"
            f"{_table(mine, shown.caption)}</section>"
        )
    if left:
        parts.append(f"<h3>What belongs to no figure</h3>{_table(left, paper.key)}")
    return parts


def _table(rows: Sequence[Row], what: str) -> str:
    if not rows:
        return "<p>The paper gives no numbers with it.</p>"
    heads = "".join(f"<th scope='col'>{head}</th>" for head in ("quantity", "paper", "ours", "n"))
    lines = "".join(
        f"<tr><th scope='row'>{_text(row['quantity'])}</th><td>{_text(paper_in_words(row))}</td>"
        f"<td>{_text(ours_in_words(row))}</td><td>{row['n']}</td></tr>"
        for row in rows
    )
    label = f"numbers of {what}"
    return (
        f"<div class='rows' tabindex='0' role='region' aria-label='{_text(label)}'><table>"
        f"<thead><tr>{heads}</tr></thead><tbody>{lines}</tbody></table></div>"
    )


def _text(value: object) -> str:
    return html.escape(str(value))
