"""``fiberplan diagnose``: why a plan is as it is."""

import dataclasses
import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated

import typer

from fiberplan.cli.answers import say_json
from fiberplan.cli.options import JsonOption, PlanArgument
from fiberplan.cli.output import say, working
from fiberplan.cli.report import assumptions, incomplete, openings, priorities
from fiberplan.cli.report_facts import unknown_facts

if TYPE_CHECKING:
    from fiberplan.plan import Plan
    from fiberplan.plan.diagnosis import Diagnosis, Loss, Reversals


def diagnose(
    plan: PlanArgument,
    prove: Annotated[bool, typer.Option(help="Prove what pairs need, too: seconds for each.")] = False,
    json: JsonOption = False,
) -> None:
    """Say who did not arrive, why and who was in the way, what set the makespan, and how often joints turn back.

    Exit 0 if every target is reached and the motion is proven safe, 1 if not.
    """
    with working("diagnosing"):
        from fiberplan.plan import Plan
        from fiberplan.plan.diagnosis import diagnose as find_causes
        from fiberplan.plan.diagnosis import displaced

        read = Plan.read(plan)
        diagnosis, faults = find_causes(read, prove), read.faults()
    if json:
        aside = {"displaced": displaced(read), "left_out": read.problem.left_out, "faults": faults}
        say_json(
            dataclasses.asdict(diagnosis)
            | aside
            | {"assumptions": read.certificate.assumptions, "unknown": unknown_facts(read)}
        )
    else:
        say(str(read), style="bold")
        for line in (*(_loss(read, loss) for loss in diagnosis.losses), *faults):
            say(line, style="yellow")
        for line in (*openings(read.problem.plane, read.certificate), *assumptions(read, read.certificate)):
            say(line)
        for line in (*displaced(read), *read.problem.left_out, *_time(diagnosis, read)):
            say(line)
        if prove and not diagnosis.pair_bounds:
            say("nobody is said to need longer than their joints do: there is nothing to prove")
    raise typer.Exit(1 if faults or incomplete(read) else 0)


def _loss(plan: "Plan", loss: "Loss") -> str:
    """Outcome, cause, priority, distance and blockers of one loss."""
    facts = [priorities(plan, loss) or f"priority {loss.priority:g}"]
    if not math.isnan(loss.distance):
        facts.append(f"{loss.distance:.3f} mm from its target")
    if loss.names:
        facts.append(f"in the way: {', '.join(loss.names)}")
    outcome = loss.outcome.name.lower()
    return f"lost {loss.id}: {outcome}, {loss.cause}; {'; '.join(facts)}"


def _time(diagnosis: "Diagnosis", plan: "Plan") -> Iterator[str]:
    """What set the makespan, and how smooth the motion is."""
    if diagnosis.bound_by is not None:
        slow = diagnosis.bound_by
        yield f"slowest joints: {slow.id} needs {slow.needed:.3f} s, and stops at {slow.stops:.3f} s"
    if diagnosis.slowest:
        last = ", ".join(f"{s.id} at {s.stops:.3f} s (needs {s.needed:.3f} s)" for s in diagnosis.slowest)
        yield f"last to stop: {last}"
    yield from diagnosis.pair_bounds
    for joint, count in (("alpha", diagnosis.alpha), ("beta", diagnosis.beta)):
        yield f"reversals of {joint}: {_reversals(count, plan)}"


def _reversals(count: "Reversals", plan: "Plan") -> str:
    who = "" if count.positioner is None else f" ({plan.problem.plane.ids[count.positioner]})"
    return f"median {count.median:g}, at most {count.most}{who}"
