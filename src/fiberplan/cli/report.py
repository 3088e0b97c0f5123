"""Plans and certificates as lines of text."""

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING

from fiberplan.cli.output import say

if TYPE_CHECKING:
    from pathlib import Path

    from fiberplan.certificates import Certificate, Contact
    from fiberplan.focal_plane import FocalPlane
    from fiberplan.plan import Plan
    from fiberplan.plan.diagnosis import Loss

LISTED = 5  # lines of one kind that are shown without --verbose
_LONGEST = 200  # letters of a note that are


def lost_targets(plan: "Plan") -> Iterator[str]:
    """A line for each lost target, those of highest priority first."""
    from fiberplan.plan.diagnosis import losses

    lost = (loss for loss in losses(plan) if loss.positioner in plan.lost)
    for loss in sorted(lost, key=lambda loss: -loss.priority):
        why = priorities(plan, loss)
        yield f"lost {loss}" + (f"; {why}" if why else "")


def folded(lines: Iterable[str], what: str, verbose: bool) -> Iterator[str]:
    """The first few of `lines`, and how many more there are; all and whole if `verbose`."""
    listed = list(lines)
    if verbose:
        yield from listed
        return
    yield from listed[:LISTED]
    if len(listed) > LISTED:
        yield f"and {len(listed) - LISTED} more {what}: --verbose tells them all, as does --json"


def say_plan(
    plan: "Plan",
    first: Iterable[str],
    faults: Iterable[str],
    notes: Iterable[str],
    written: "Sequence[Path]",
    verbose: bool = False,
) -> None:
    """Print a plan: what is wrong with it, the facts in a short table, losses, assumptions, the verdict, and notes.

    Args:
        plan: to tell of.
        first: lines before all others.
        faults: what in it does not hold.
        notes: the least important; those that say the same are told once.
        written: files.
        verbose: tell everything.
    """
    from fiberplan.plan.summary import headline

    plane, faults = plan.problem.plane, list(faults)
    for line in first:
        say(line, style="bold")
    for line in (*folded(findings(plane, plan.certificate), "findings", verbose), *faults):
        say(line, style="yellow")
    for name, value in headline(plan):
        say(f"{name:<12}  {value}")
    for line in folded(lost_targets(plan), "losses", verbose):
        say(line, style="yellow")
    for line in (
        *folded(openings(plane, plan.certificate), "openings", verbose),
        *folded(assumptions(plan, plan.certificate), "lines on what is assumed", verbose),
    ):
        say(line)
    if not faults:
        say(str(plan.certificate), style="green")
    for line in folded((f"note: {note}" for note in dict.fromkeys(notes)), "notes", verbose):
        say(line if verbose or len(line) <= _LONGEST else f"{line[:_LONGEST]}...")
    say(f"wrote {' and '.join(map(str, written))}" if written else "nothing written: -o FILE keeps the plan")


def priorities(plan: "Plan", loss: "Loss") -> str:
    """Which priority gave way to which, if that is why a target was lost; "" if not."""
    problem = plan.problem
    assert problem.priority is not None  # set on construction
    kept = [float(problem.priority[b]) for b in loss.blockers if b >= 0 and problem.has_goal[b]]
    if not kept or not max(kept) > loss.priority:
        return ""
    return f"priority {loss.priority:g} gives way to {max(kept):g}: larger matters more"


def openings(plane: "FocalPlane", certificate: "Certificate") -> Iterator[str]:
    """A line for each pair that begins nearer than the margin: how near, and when it has the margin."""
    for pair in certificate.opening:
        first, second = (plane.label(index) for index in pair.pair)
        when = "never reaches it" if pair.time == math.inf else f"has it from {pair.time:.3f} s on"
        what = f"begins at {pair.clearance:.4f} mm, below the margin of {certificate.margin:g} mm, only comes apart"
        yield f"opening: {first} and {second}: {what} and {when}"


def about(certificate: "Certificate") -> Iterator[str]:
    """Which geometry a proof is about, and with which margin."""
    if certificate.geometry is not None:
        yield f"about {certificate.geometry}; margin {certificate.margin:g} mm"


def assumptions(plan: "Plan", certificate: "Certificate") -> Iterator[str]:
    """What a proof rests on: sizes and omissions, then who is only taken to stand where it is."""
    ids = plan.problem.plane.ids
    places = {f"positioner '{ids[i]}' stands at": needed for i, needed in plan.needed_guesses.items()}
    guesses = [text for text in plan.problem.assumptions if text.startswith(tuple(places))] if places else []
    for text in certificate.assumptions:
        if text not in guesses:
            yield f"assumed: {text}"
    if guesses:
        these = f"these {len(guesses)} stand where they are" if len(guesses) > 1 else "this one stands where it is"
        yield f"{'safe' if certificate.ok else 'judged'} if {these} taken to stand:"
        yield from (f"  {text}" for text in guesses)
        free = [ids[i] for i, needed in plan.needed_guesses.items() if not needed]
        if free and certificate.ok:
            yield f"  of these the motion is safe wherever they stand: {', '.join(free)}"


def incomplete(plan: "Plan") -> bool:
    """Whether a target is lost, or was given to no positioner."""
    return bool(len(plan.lost) or plan.problem.left_out)


def cautions(plane: "FocalPlane", margin: float) -> Iterator[str]:
    """What a proof of safety says less about than one may think."""
    yield from bodiless(plane)
    if plane.bodies and margin == 0:
        yield "the margin is 0 mm: arms may pass as close as they can without touching; --margin keeps them apart"


def bodiless(plane: "FocalPlane") -> Iterator[str]:
    """What is said of a focal plane in which nothing can touch."""
    if not plane.bodies:
        yield f"{plane.name} has no bodies: nothing can touch, so the proof says nothing"


def findings(plane: "FocalPlane", certificate: "Certificate") -> Iterator[str]:
    """A line for each contact, undecided pair, zone of avoidance and violation, then for what touches at rest."""
    for what, contacts in (
        ("contact", certificate.contacts),
        ("undecided", certificate.undecided),
        ("at rest, neither can move", certificate.resting),
    ):
        for contact in contacts:
            yield f"{what}: {_contact(plane, contact)}"
    for zone in certificate.zones:
        yield f"zone of avoidance: {plane.ids[zone.positioner]} at {zone.time:.3f} s, slider {zone.slider:.4f} mm"
    for violation in certificate.violations:
        yield f"violation: {violation}"


def _contact(plane: "FocalPlane", contact: "Contact") -> str:
    first, second = (plane.label(index) for index in contact.pair)
    return f"{first} and {second} at {contact.time:.3f} s, clearance {contact.clearance:.4f} mm"


def tolerated(plane: "FocalPlane", certificate: "Certificate") -> Iterator[str]:
    """A line on what a safe motion tolerates before anything touches."""
    if certificate.ok:
        found = certificate.tolerates
        stall = found.reaction
        who = ""
        if stall.positioner >= 0:
            who = f" ({plane.ids[stall.positioner]} stops, {plane.ids[stall.other]} touches it)"
        yield (
            f"before anything touches: clocks off by {1e3 * found.jitter:.1f} ms, or arms by "
            f"{found.position_error:.3f} mm, or one that stops dead for {stall.seconds:.3f} s{who}"
        )
