"""Arguments and options that several commands share, with their units."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from fiberplan.cli.completion import instrument_names
from fiberplan.errors import FiberplanError

InstrumentArgument = Annotated[
    str,
    typer.Argument(
        metavar="INSTRUMENT", help="A name, or an instrument's file or folder.", autocompletion=instrument_names
    ),
]
PlanArgument = Annotated[Path, typer.Argument(metavar="PLAN", help="A plan written by `fiberplan plan`.")]
SeedOption = Annotated[int, typer.Option(metavar="N", help="Seed of every random choice.", min=0, max=2**63 - 1)]
JsonOption = Annotated[bool, typer.Option("--json", help="Answer in JSON (mm, s, deg).")]
RegionsOption = Annotated[int, typer.Option(metavar="N", help="Parts of the array over which these are spread.", min=1)]
SolverOption = Annotated[Literal["milp", "heuristic"], typer.Option(help="Prove what is best, or only bound it.")]
PriorityOrder = Annotated[
    Literal["larger", "smaller"], typer.Option(help="Which priority matters more in CATALOGUE; smaller: 1 is first.")
]
VerboseOption = Annotated[bool, typer.Option("--verbose", help="Tell everything.")]


def no_option(text: str) -> str:
    """An argument of a command that lets options it does not know pass, since negative numbers look like such.

    Raises:
        FiberplanError: it is an option all the same.
    """
    if text.startswith("--") or (text[:1] == "-" and text[1:2].isalpha()):
        raise FiberplanError(f"No such option '{text}'")
    return text


def number_or_option(text: str) -> float:
    """A number, negative or not.

    Raises:
        FiberplanError: it is an option.
        typer.BadParameter: it is no number.
    """
    try:
        return float(no_option(text))
    except ValueError:
        raise typer.BadParameter(f"'{text}' is not a number") from None
