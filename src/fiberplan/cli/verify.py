"""``fiberplan verify``: is the motion in a plan file safe, whoever planned it?"""

from typing import Annotated

import typer

from fiberplan.cli.answers import say_json
from fiberplan.cli.options import JsonOption, PlanArgument
from fiberplan.cli.output import say, working
from fiberplan.cli.report import cautions, certificate_facts, findings


def verify(
    plan: PlanArgument,
    margin: Annotated[
        float | None, typer.Option(metavar="MM", help="Clearance to prove (mm); the plan's own if not given.", min=0.0)
    ] = None,
    jitter: Annotated[float, typer.Option(metavar="S", help="Each clock may be off by this (s).", min=0.0)] = 0.0,
    position_error: Annotated[
        float, typer.Option(metavar="MM", help="Each arm may be off by this (mm).", min=0.0)
    ] = 0.0,
    json: JsonOption = False,
) -> None:
    """Prove a plan safe, continuously in time, or say what touches and when; exit 0 if safe, 1 if not.

    Also checked: that the motion begins at the stated start, and that whoever is said to arrive does.
    """
    with working("verifying"):
        from fiberplan.certificates import verify as prove
        from fiberplan.plan import Plan

        read = Plan.read(plan)
        plane, asked = read.problem.plane, read.problem.margin if margin is None else margin
        certificate = prove(plane, read.trajectory, asked, jitter=jitter, position_error=position_error)
        faults = [fault for fault in read.faults() if fault != str(read.certificate)]

    safe = certificate.ok and not faults
    notes = list(cautions(plane, asked))
    if json:
        say_json({"ok": safe, "certificate": certificate_facts(plane, certificate), "faults": faults, "notes": notes})
        raise typer.Exit(0 if safe else 1)
    for line in (*findings(plane, certificate), *faults):
        say(line, style="yellow")
    for note in notes:
        say(f"note: {note}")
    say(str(certificate) if safe or not certificate.ok else "not as stated", style="green" if safe else "red")
    raise typer.Exit(0 if safe else 1)
