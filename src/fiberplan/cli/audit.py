"""``fiberplan audit``: are the motions in these files safe, whoever made them?"""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fiberplan.cli.answers import say_json
from fiberplan.cli.options import InstrumentArgument, JsonOption
from fiberplan.cli.output import complain, made_folder, page_output, refuse_unwritable, say, working
from fiberplan.cli.report import cautions, findings
from fiberplan.cli.report_facts import certificate_facts
from fiberplan.cli.start import Margin, begun
from fiberplan.errors import FiberplanError

if TYPE_CHECKING:
    from fiberplan.focal_plane import FocalPlane
    from fiberplan.hardware import Audit

_SHOWN = 3  # findings in the line of a file


def audit(
    instrument: InstrumentArgument,
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILE...",
            help="SDSS trajectories, DESI move tables, MOONS waveforms, tables of positioner, time, alpha, beta.",
        ),
    ],
    state: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Where everyone stands before each file; folded if not given.", show_default=False
        ),
    ] = None,
    margin: Margin = None,
    json: JsonOption = False,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="FILE", help="Write an HTML report here.")
    ] = None,
    pages: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Write a page of each motion here, to see it move.")
    ] = None,
) -> None:
    """Certify what files make the motors do, a line a file; exit 0 if all is safe, 1 if not, 2 if one cannot be read.

    A motion that is too fast, leaves a joint's range or moves an offline robot is not safe either.
    """
    refuse_unwritable(page_output(output), inputs=(*files, state))
    with working("auditing") as tell:
        from fiberplan.focal_plane import FocalPlane
        from fiberplan.hardware.audit import audit as judge

        plane = FocalPlane.load(instrument)
        before = begun(plane, state, None)
        wanted = (plane.recommended_margin or 0.0) if margin is None else margin
        done: list[Audit] = []
        unread: list[tuple[Path, str]] = []
        for k, file in enumerate(files):
            tell(f"{k + 1} of {len(files)}")
            try:
                done.append(judge(plane, file, before, wanted))
            except FiberplanError as error:
                unread.append((file, str(error)))
        rows = [_row(plane, each) for each in done]
        shown = [] if pages is None else _pages(plane, done, made_folder(pages))
        for row, page in zip(rows, shown, strict=False):
            row["page"] = os.path.relpath(page, Path() if output is None else output.parent)
        if output is not None:
            from fiberplan.visuals.night_report import night_report

            title = f"Audit of {len(files)} motions of {plane.name}, margin {wanted:g} mm"
            lost = [
                {"file": str(p), "kind": "unread", "ok": False, "findings": [why], "notes": []} for p, why in unread
            ]
            try:
                night_report(title, [*rows, *lost], output)
            except FiberplanError:
                for page in shown:
                    page.unlink(missing_ok=True)
                raise
    if json:
        facts = [_facts(plane, each, row) for each, row in zip(done, rows, strict=True)]
        missed = [{"file": path, "error": why} for path, why in unread]
        say_json(
            {
                "instrument": plane.name,
                "margin": wanted,
                "files": facts,
                "unread": missed,
                "written": [*shown, *([output] if output else [])],
            }
        )
    else:
        for note in cautions(plane, wanted):
            say(f"note: {note}")
        for each, row in zip(done, rows, strict=True):
            say(_line(plane, each, row), style="green" if row["ok"] else "red")
        for text in _assumed(done):
            say(text)
        if shown:
            say(f"wrote {len(shown)} pages into {pages}")
        if output is not None:
            say(f"wrote {output}")
    for _, why in unread:
        complain(why)
    raise typer.Exit(2 if unread else 0 if all(row["ok"] for row in rows) else 1)


def _row(plane: "FocalPlane", each: "Audit") -> dict[str, Any]:
    """What the report says of one file."""
    proof, (pair, clearance) = each.certificate, each.closest
    found = list(findings(plane, proof))
    row: dict[str, Any] = {"file": str(each.path), "kind": each.kind, "ok": proof.ok, "findings": found}
    row |= {"notes": [*each.executed.notes, *(f"assumed: {text}" for text in proof.assumptions)]}
    row |= {"pair": "" if pair is None else " and ".join(plane.label(k) for k in pair)}
    row |= {"closest [mm]": "" if pair is None else clearance, "contacts": len(proof.contacts) + len(proof.undecided)}
    row |= {"violations": len(proof.violations) + len(proof.zones)}
    return row | {"time [s]": each.duration, "bound [s]": each.bound, "lost [s]": each.duration - each.bound}


def _pages(plane: "FocalPlane", done: list["Audit"], folder: Path) -> list[Path]:
    """A page of each motion, numbered, since files of other folders may have the same name."""
    from fiberplan.visuals.motion_page import show_motion

    written = [folder / f"{k + 1:03d}-{each.path.name}.html" for k, each in enumerate(done)]
    for each, page in zip(done, written, strict=True):
        facts = (("file", each.path.name), ("kind", each.kind))
        show_motion(plane, each.executed, each.certificate, page, f"{each.path.name} on {plane.name}", facts)
    return written


def _line(plane: "FocalPlane", each: "Audit", row: dict[str, Any]) -> str:
    """One file in one line."""
    time = f"{each.duration:.3f} s, {row['lost [s]']:.3f} s over the bound"
    parts = [str(each.certificate), *_first(row["findings"]), time]
    if row["pair"] and row["ok"]:
        parts.insert(1, f"closest {row['pair']}")
    if each.executed.notes:
        parts.append(f"notes: {len(each.executed.notes)} (--json)")
    return f"{each.path} ({each.kind}): {'; '.join(parts)}"


def _assumed(done: list["Audit"]) -> Iterator[str]:
    """What the proofs rest on, each once: of all files, or of those that are named."""
    of: dict[str, list[str]] = {}
    for each in done:
        for text in each.certificate.assumptions:
            of.setdefault(text, []).append(each.path.name)
    for text, names in of.items():
        more = f" and {len(names) - 1} more" if len(names) > 1 else ""
        yield f"assumed: {text}" if len(names) == len(done) else f"assumed of {names[0]}{more}: {text}"


def _first(found: list[str]) -> Iterator[str]:
    yield from found[:_SHOWN]
    if len(found) > _SHOWN:
        yield f"and {len(found) - _SHOWN} more"


def _facts(plane: "FocalPlane", each: "Audit", row: dict[str, Any]) -> dict[str, Any]:
    said = {"file": each.path, "kind": each.kind, "certificate": certificate_facts(plane, each.certificate)}
    said |= {"closest": {"pair": row["pair"], "clearance": each.closest[1]}, "duration": each.duration}
    return said | {"bound": each.bound, "lost": row["lost [s]"], "notes": each.executed.notes}
