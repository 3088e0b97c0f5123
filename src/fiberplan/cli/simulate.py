"""``fiberplan simulate``: what robots make of a file when clocks, motors and the line to them are not perfect."""

from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fiberplan.cli.answers import say_json
from fiberplan.cli.options import InstrumentArgument, JsonOption, SeedOption
from fiberplan.cli.output import Output, refuse_unwritable, say, working
from fiberplan.cli.report import bodiless
from fiberplan.cli.start import begun
from fiberplan.errors import FiberplanError

if TYPE_CHECKING:
    from fiberplan.certificates import Certificate, Contact
    from fiberplan.focal_plane import FocalPlane
    from fiberplan.hardware.simulated import Faults
    from fiberplan.motion import Executed

_SHOWN = 5  # pairs, or robots, that have a line of their own

_LATEST = 1e9  # [s]


def simulate(
    instrument: InstrumentArgument,
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A controller's file, or a table of motion.")],
    state: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Where everyone stands before; folded if not given.", show_default=False),
    ] = None,
    latency: Annotated[
        float | None,
        typer.Option(metavar="S", help="Robots start, and stop, up to so late; as the file's controller.", min=0.0),
    ] = None,
    drift: Annotated[float, typer.Option(metavar="PART", help="Clocks are fast or slow by up to this part.")] = 0.0,
    tracking: Annotated[float, typer.Option(metavar="DEG", help="Joints are off by up to this.", min=0.0)] = 0.0,
    step: Annotated[float, typer.Option(metavar="DEG", help="Joints stop at multiples of this.", min=0.0)] = 0.0,
    stall: Annotated[
        list[str] | None, typer.Option(metavar="ID@S", help="It stops for good at that time. Repeatable.")
    ] = None,
    absent: Annotated[list[str] | None, typer.Option(metavar="ID,ID", help="They never start. Repeatable.")] = None,
    any_stall: Annotated[int, typer.Option(metavar="N", help="So many stall: who and when is drawn.", min=0)] = 0,
    any_absent: Annotated[int, typer.Option(metavar="N", help="So many never start, drawn.", min=0)] = 0,
    abort: Annotated[float | None, typer.Option(metavar="S", help="All are told to stop then.", min=0.0)] = None,
    margin: Annotated[float, typer.Option(metavar="MM", help="Nearer than this is told.", min=0.0)] = 0.0,
    seed: SeedOption = 0,
    runs: Annotated[int, typer.Option(metavar="N", help="So many, with seeds from --seed on.", min=1)] = 1,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="FILE", help="Write where the first run leaves everyone.")
    ] = None,
    json: JsonOption = False,
) -> None:
    """Execute a file robot by robot, with faults, and say what touches and when; exit 0 if nothing does, 1 if not.

    The proof that is told beside is of all clocks and joints that are off by no more than this, but for robots that
    stall or never start. What is written with -o is a start for the next plan.
    """
    refuse_unwritable(Output(output, (".ecsv",), "a table"), inputs=(file, state))
    with working("simulating") as tell:
        import numpy as np

        from fiberplan.certificates.touching import Touching
        from fiberplan.focal_plane import FocalPlane
        from fiberplan.hardware.audit import read_motion
        from fiberplan.hardware.controller import known_to
        from fiberplan.hardware.simulated import Faults, as_told, proof_within, simulated, state_after

        plane = FocalPlane.load(instrument)
        before = known_to(plane, begun(plane, state, None))
        kind, executed = read_motion(file, plane, before)
        faults = Faults(
            latency=executed.clock_error if latency is None else latency,
            drift=drift,
            tracking=float(np.radians(tracking)),
            step=float(np.radians(step)),
            stalls=_stalls(plane, stall or ()),
            absent=_absent(plane, absent or ()),
            abort=np.inf if abort is None else abort,
            any_stall=any_stall,
            any_absent=any_absent,
        )
        proof = proof_within(plane, executed, faults, margin)
        touching, found = Touching(plane, margin), {}
        for k in range(seed, seed + runs):
            if k % 100 == 0:
                tell(f"run {k - seed + 1} of {runs}")
            found[k] = touching.contacts(simulated(executed.trajectory, faults, k))
        drawn = faults.drawn(executed.trajectory, seed)
        left = state_after(plane, simulated(executed.trajectory, drawn, seed), drawn, as_told(before, executed))
        if output is not None:
            left.write(output, plane)
    bad = {k: contacts for k, contacts in found.items() if contacts}
    if json:
        facts = {"instrument": plane.name, "file": file, "kind": kind, "runs": runs, "seed": seed, "margin": margin}
        facts |= {"touching": {str(k): _facts(plane, contacts) for k, contacts in bad.items()}, "proof": str(proof)}
        facts |= {"cannot_move": [plane.ids[i] for i in (*drawn.stalls, *drawn.absent)], "notes": executed.notes}
        say_json(facts | {"assumptions": executed.assumptions, "written": [output] if output else []})
        raise typer.Exit(1 if bad else 0)
    lines = _one(plane, found[seed], drawn) if runs == 1 else _many(plane, found, bad, seed)
    say(f"{file} ({kind}), {executed.trajectory.duration:.3f} s, {_faults(faults)}", style="bold")
    for line in lines:
        say(line, style="red" if bad else "green")
    for line in (*(f"note: {text}" for text in bodiless(plane)), *_about(plane, executed, proof, faults)):
        say(line)
    say(f"wrote {output}, a start for the next plan" if output else "nothing written: -o FILE keeps where all stand")
    raise typer.Exit(1 if bad else 0)


def _stalls(plane: "FocalPlane", given: Sequence[str]) -> dict[int, float]:
    """Who stalls when.

    Raises:
        FiberplanError: no positioner of this name, or no time; it is quoted.
    """
    stalls = {}
    for text in given:
        name, at, when = text.rpartition("@")
        try:
            seconds = float(when) if at else float("nan")
        except ValueError:
            seconds = float("nan")
        if not 0 <= seconds <= _LATEST:
            raise FiberplanError(f"--stall {text}: expected ID@S, a positioner and a time of 0 s or more")
        stalls[_index(plane, f"--stall {text}", name)] = seconds
    return stalls


def _absent(plane: "FocalPlane", given: Sequence[str]) -> tuple[int, ...]:
    names = [name.strip() for text in given for name in text.split(",") if name.strip()]
    return tuple(dict.fromkeys(_index(plane, "--absent", name) for name in names))


def _index(plane: "FocalPlane", option: str, name: str) -> int:
    from fiberplan.tables.wording import nearest

    if name not in plane.names:
        raise FiberplanError(f"{option}: {plane.name} has no positioner '{name}'{nearest(name, plane.names)}")
    return plane.names[name]


def _faults(faults: "Faults") -> str:
    """What goes wrong, in a few words."""
    import numpy as np

    parts = [f"up to {faults.latency:g} s late"] if faults.latency else []
    parts += [f"clocks to {faults.drift:g}"] if faults.drift else []
    parts += [f"joints to {np.degrees(faults.tracking):.3g} deg"] if faults.tracking else []
    parts += [f"steps of {np.degrees(faults.step):.3g} deg"] if faults.step else []
    stalls, absent = len(faults.stalls) + faults.any_stall, len(faults.absent) + faults.any_absent
    parts += [f"{stalls} stall"] if stalls else []
    parts += [f"{absent} never start"] if absent else []
    parts += [f"aborted at {faults.abort:g} s"] if faults.abort < np.inf else []
    return ", ".join(parts) or "nothing goes wrong"


def _one(plane: "FocalPlane", contacts: "Sequence[Contact]", faults: "Faults") -> Iterator[str]:
    """What one run was."""
    for i, when in faults.stalls.items():
        yield f"stalls: {plane.ids[i]} at {when:.3f} s"
    if faults.absent:
        yield f"never start: {', '.join(plane.ids[i] for i in faults.absent)}"
    if not contacts:
        yield "nothing touches"
    for contact in contacts:
        first, second = (plane.label(k) for k in contact.pair)
        yield f"touch: {first} and {second} at {contact.time:.3f} s, clearance {contact.clearance:.4f} mm"


def _many(
    plane: "FocalPlane", found: "dict[int, tuple[Contact, ...]]", bad: "dict[int, tuple[Contact, ...]]", seed: int
) -> Iterator[str]:
    """What many runs were."""
    if not bad:
        yield f"nothing touches in {len(found)} runs, seeds {seed} to {seed + len(found) - 1}"
        return
    yield f"something touches in {len(bad)} of {len(found)} runs; --seed {min(bad)} is the first of them"
    pairs = Counter(contact.pair for contacts in bad.values() for contact in contacts)
    for (a, b), count in pairs.most_common(_SHOWN):
        yield f"touch: {plane.label(a)} and {plane.label(b)} in {count} runs"
    if len(pairs) > _SHOWN:
        yield f"and {len(pairs) - _SHOWN} more pairs"


def _about(plane: "FocalPlane", executed: "Executed", proof: "Certificate", faults: "Faults") -> Iterator[str]:
    exempt = " but for who stalls or never starts" if faults.stops_some else ""
    yield f"proven, whatever clocks and joints do within this{exempt}: {proof}"
    yield from executed.notes
    for text in executed.assumptions:
        yield f"assumed: {text}"


def _facts(plane: "FocalPlane", contacts: "Sequence[Contact]") -> list[dict[str, Any]]:
    return [{"pair": [plane.label(k) for k in c.pair], "time": c.time, "clearance": c.clearance} for c in contacts]
