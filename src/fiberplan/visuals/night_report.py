"""One self-contained HTML page of a night of audited motions: a row a file, and what is wrong with each."""

import os
from collections.abc import Mapping, Sequence
from typing import Any
from urllib.parse import quote

from fiberplan.visuals.report_page import shown, text, write_page

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
        "<table><thead><tr>",
        *(f"<th scope='col' class='{_kind(head)}'>{text(head)}</th>" for head in _HEADS),
        "</tr></thead><tbody>",
        *(_row(row) for row in rows),
        "</tbody></table>",
        *(_details(row) for row in rows if row["findings"] or row["notes"]),
    ]
    write_page(title, verdict, not unsafe, parts, path)


def _row(row: Mapping[str, Any]) -> str:
    cells = [_cell(head, row.get(head, "")) for head in _HEADS[3:]]
    verdict = ("safe", "safe") if row["ok"] else ("unsafe", "NOT SAFE")
    file = text(row["file"])
    if "page" in row:
        file = f"<a href='{text(quote(row['page']))}'>{file}</a>"
    return (
        f"<tr><th scope='row'>{file}</th><td>{text(row['kind'])}</td>"
        f"<td class='{verdict[0]}'>{verdict[1]}</td>{''.join(cells)}</tr>"
    )


def _cell(head: str, value: Any) -> str:
    return f"<td class='{_kind(head)}'>{text(shown(value))}</td>"


def _details(row: Mapping[str, Any]) -> str:
    lines = [*(f"<li>{text(line)}</li>" for line in row["findings"])]
    lines += [f"<li><small>{text(line)}</small></li>" for line in row["notes"]]
    return f"<h2>{text(row['file'])}</h2><ul>{''.join(lines)}</ul>"


def _kind(head: str) -> str:
    return "number" if head in _NUMBERS else "word"
