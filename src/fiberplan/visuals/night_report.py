"""One self-contained HTML page of a night of audited motions: a row a file, and what is wrong with each."""

import html
import os
from collections.abc import Mapping, Sequence
from typing import Any
from urllib.parse import quote

from fiberplan.errors import FiberplanError
from fiberplan.tables.atomic import write_whole

_STYLE = """
:root { color-scheme: light dark; font: 15px/1.45 system-ui, sans-serif }
body { max-width: 76rem; margin: 2rem auto; padding: 0 1rem }
table { border-collapse: collapse; width: 100% }
th, td { text-align: left; padding: .3rem .7rem; border-bottom: 1px solid #8885; vertical-align: top }
td.number, th.number { text-align: right; font-variant-numeric: tabular-nums }
.safe { color: #1a7f37 } .unsafe { color: #c62828; font-weight: 600 }
li { margin: .15rem 0 } small { opacity: .75 }
"""
_HEADS = (
    "file",
    "kind",
    "verdict",
    "closest [mm]",
    "pair",
    "contacts",
    "violations",
    "time [s]",
    "bound [s]",
    "lost [s]",
)
_NUMBERS = {"closest [mm]", "contacts", "violations", "time [s]", "bound [s]", "lost [s]"}


def night_report(title: str, rows: Sequence[Mapping[str, Any]], path: str | os.PathLike) -> None:
    """Write the page.

    Args:
        title: what was audited, at which margin.
        rows: a mapping a file: `file` and `ok`, then the columns of the page by their headings, `findings` and `notes`,
            each a list of lines, and `page`, the address of its own page, if it has one.
        path: of the page.

    Raises:
        FiberplanError: it cannot be written.
    """
    unsafe = sum(not row["ok"] for row in rows)
    verdict = (
        f"{unsafe} of {len(rows)} files are not proven safe" if unsafe else f"all {len(rows)} files are proven safe"
    )
    parts = [
        "<!doctype html><html lang='en'><meta charset='utf-8'>",
        "<meta name='viewport' content='width=device-width, initial-scale=1'>",
        f"<title>{_text(title)}</title><style>{_STYLE}</style><body><h1>{_text(title)}</h1>",
        f"<p class='{'unsafe' if unsafe else 'safe'}'>{_text(verdict)}</p><table><thead><tr>",
        *(f"<th scope='col' class='{_kind(head)}'>{_text(head)}</th>" for head in _HEADS),
        "</tr></thead><tbody>",
        *(_row(row) for row in rows),
        "</tbody></table>",
        *(_details(row) for row in rows if row["findings"] or row["notes"]),
        "</body></html>\n",
    ]
    write_whole(path, "".join(parts).encode(), FiberplanError)


def _row(row: Mapping[str, Any]) -> str:
    cells = [_cell(head, row.get(head, "")) for head in _HEADS[3:]]
    verdict = ("safe", "safe") if row["ok"] else ("unsafe", "NOT SAFE")
    file = _text(row["file"])
    if "page" in row:
        file = f"<a href='{_text(quote(row['page']))}'>{file}</a>"
    return (
        f"<tr><th scope='row'>{file}</th><td>{_text(row['kind'])}</td>"
        f"<td class='{verdict[0]}'>{verdict[1]}</td>{''.join(cells)}</tr>"
    )


def _cell(head: str, value: Any) -> str:
    shown = f"{value:.3f}" if isinstance(value, float) else str(value)
    return f"<td class='{_kind(head)}'>{_text(shown)}</td>"


def _details(row: Mapping[str, Any]) -> str:
    lines = [*(f"<li>{_text(line)}</li>" for line in row["findings"])]
    lines += [f"<li><small>{_text(line)}</small></li>" for line in row["notes"]]
    return f"<h2>{_text(row['file'])}</h2><ul>{''.join(lines)}</ul>"


def _kind(head: str) -> str:
    return "number" if head in _NUMBERS else "word"


def _text(value: Any) -> str:
    return html.escape(str(value))
