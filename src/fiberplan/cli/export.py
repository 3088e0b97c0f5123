"""``fiberplan export``: a plan's motion for other programs, and for controllers."""

import inspect
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fiberplan.cli.answers import say_json
from fiberplan.cli.completion import formats
from fiberplan.cli.options import JsonOption, PlanArgument
from fiberplan.cli.output import Output, complain, refuse_unwritable, say, working
from fiberplan.errors import FiberplanError, UnprovenError

if TYPE_CHECKING:
    from collections.abc import Callable

    from fiberplan.hardware import HandedOver

_TABLES = ("ecsv", "motions")


def export(
    plan: PlanArgument,
    to: Annotated[
        str,
        typer.Option(
            "--to",
            metavar="FORMAT",
            help="ecsv: a row a knot; motions: a row a move; or a controller: sdss, desi, moons, pfs.",
            autocompletion=formats,
        ),
    ],
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help="Write it here.")],
    allowance: Annotated[
        float | None,
        typer.Option(
            metavar="MM",
            help="What motors do may keep this much less than the plan's margin (mm); 0.05 if not given.",
            min=0.0,
        ),
    ] = None,
    delay: Annotated[
        float | None, typer.Option(metavar="S", help="Time of the first point (s); 1 if not given (sdss).", min=0.0)
    ] = None,
    calibration: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="A fp-*.ecsv that names buses and linear motors, if given (desi)."),
    ] = None,
    tail: Annotated[
        bool | None, typer.Option("--tail/--no-tail", help="Back and forth in creep at the end (desi).")
    ] = None,
    power: Annotated[
        float | None,
        typer.Option(metavar="SHARE", help="Of a supply's moving units, at most so many move at once (desi).", min=0.0),
    ] = None,
    latency: Annotated[
        float | None, typer.Option(metavar="S", help="Units' clocks may be off by this; 0.02 if not given (moons).")
    ] = None,
    visit: Annotated[int | None, typer.Option(metavar="N", help="pfs_visit_id (pfs).", min=0)] = None,
    config: Annotated[int | None, typer.Option(metavar="N", help="pfs_config_id (pfs).", min=0)] = None,
    json: JsonOption = False,
) -> None:
    """Write a plan's motion in another format, times in s and angles in degrees.

    For a controller, what is written is read back and proven: exit 0 if what it makes the motors do is safe; if not, 1,
    and nothing is written.
    """
    refuse_unwritable(_output(to, output), inputs=(plan, calibration))
    options = {"allowance": allowance, "delay": delay, "calibration": calibration, "tail": tail}
    options |= {"power": power, "latency": latency, "visit": visit, "config": config}
    given = {name: value for name, value in options.items() if value is not None}
    with working("exporting"):
        from fiberplan.plan import Plan

        writer = _writer(to, given)
        try:
            done = writer(Plan.read(plan), output, **given)
        except UnprovenError as error:
            complain(f"{error}; `fiberplan plan --for {to}` plans so that it is safe when executed")
            raise typer.Exit(1) from None
    if json:
        say_json({"format": to, "written": [output]} | _facts(done))
        return
    if done is not None:
        for name, value in done.facts.items():
            say(f"{name}: {_words(value)}")
        for text in (*done.executed.notes, *(f"assumed: {text}" for text in done.executed.assumptions)):
            say(text)
        say(f"read back, executed: {done.certificate}", style="green")
    say(f"wrote {output}")


def _output(name: str, path: Path) -> Output:
    """What is written: our tables are ECSV, and what a controller takes is the controller's."""
    return Output(path, (".ecsv",), "an ECSV table") if name in _TABLES else Output(path, (path.suffix,), f"for {name}")


def _writer(name: str, given: dict[str, Any]) -> "Callable[..., HandedOver | None]":
    """What writes the format, or for the controller, of this name, and takes the options that are given.

    Raises:
        FiberplanError: there is none, or it does not take such an option.
    """
    from fiberplan.hardware import CONTROLLERS
    from fiberplan.io.exports import EXPORTS

    if name not in CONTROLLERS and name not in EXPORTS:
        raise FiberplanError(f"no export '{name}'; there are {', '.join((*EXPORTS, *CONTROLLERS))}")
    writer: Callable[..., HandedOver | None] = CONTROLLERS[name].write if name in CONTROLLERS else EXPORTS[name]
    known = inspect.signature(writer).parameters
    for option in given:
        if option not in known:
            raise FiberplanError(f"--{option}: '{name}' has no such option")
    return writer


def _facts(done: "HandedOver | None") -> dict[str, Any]:
    if done is None:
        return {}
    said = {"summary": str(done.certificate), "smallest_clearance": done.certificate.smallest}
    said |= {"margin": done.certificate.margin, "assumptions": done.certificate.assumptions}
    return {"facts": done.facts, "executed": said | {"notes": done.executed.notes}}


def _words(value: Any) -> str:
    return ", ".join(f"{part} {key}" for key, part in value.items()) if isinstance(value, dict) else f"{value:,}"
