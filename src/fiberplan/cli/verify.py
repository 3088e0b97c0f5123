"""``fiberplan verify``: is the motion in a plan file safe, whoever planned it?"""

from typing import Annotated

import typer

from fiberplan.cli.answers import say_json
from fiberplan.cli.completion import instrument_names
from fiberplan.cli.options import JsonOption, PlanArgument
from fiberplan.cli.output import say, working
from fiberplan.cli.report import about, assumptions, cautions, findings, openings, tolerated
from fiberplan.cli.report_facts import certificate_facts, unknown_facts


def verify(
    plan: PlanArgument,
    margin: Annotated[
        float | None, typer.Option(metavar="MM", help="Clearance to prove (mm); the plan's own if not given.", min=0.0)
    ] = None,
    jitter: Annotated[float, typer.Option(metavar="S", help="Each clock may be off by this (s).", min=0.0)] = 0.0,
    position_error: Annotated[
        float, typer.Option(metavar="MM", help="Each arm may be off by this (mm).", min=0.0)
    ] = 0.0,
    instrument: Annotated[
        str | None,
        typer.Option(
            metavar="NAME|PATH", help="Prove it of this instrument, not of the plan's.", autocompletion=instrument_names
        ),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Prove a plan safe, continuously in time, or say what touches and when; exit 0 if safe, 1 if not.

    Also checked: that the motion begins at the stated start, and that whoever is said to arrive does.
    """
    with working("verifying"):
        from dataclasses import replace

        import numpy as np

        from fiberplan.certificates import verify as prove
        from fiberplan.plan import Plan

        read = Plan.read(plan)
        problem, motion, differences = read.problem, read.trajectory, []
        plane, asked = problem.plane, problem.margin if margin is None else margin
        if instrument is not None:
            from fiberplan.focal_plane import FocalPlane
            from fiberplan.focal_plane.differences import differences_of, on_the_other

            plane = on_the_other(problem.plane, FocalPlane.load(instrument))
            differences = list(differences_of(problem.plane, plane))
        assert problem.position_error is not None  # set on construction
        error = np.maximum(position_error, problem.position_error)
        opening = problem.near_start == "open" or problem.needs_opening
        certificate = prove(plane, motion, asked, jitter=jitter, position_error=error, opening=opening)
        certificate = replace(certificate, assumptions=(*certificate.assumptions, *problem.assumptions))
        faults = [fault for fault in read.faults() if fault != str(read.certificate)]

    safe = certificate.ok and not faults
    notes = [*cautions(plane, asked), *(f"the plan's own geometry differs: {text}" for text in differences)]
    if json:
        say_json(
            {"ok": safe, "certificate": certificate_facts(plane, certificate), "faults": faults, "notes": notes}
            | {"unknown": unknown_facts(read)}
        )
        raise typer.Exit(0 if safe else 1)
    for line in (*findings(plane, certificate), *faults):
        say(line, style="yellow")
    for note in notes:
        say(f"note: {note}")
    for line in (*openings(plane, certificate), *assumptions(read, certificate)):
        say(line)
    verdict = str(certificate) if safe or not certificate.ok else "not as stated"
    say("; ".join([verdict, *about(certificate), *tolerated(plane, certificate)]), style="green" if safe else "red")
    raise typer.Exit(0 if safe else 1)
