"""Arguments and options that several commands share, with their units."""

from pathlib import Path
from typing import Annotated

import typer

PlanArgument = Annotated[Path, typer.Argument(metavar="PLAN", help="A plan written by `fiberplan plan`.")]


def _countable(seed: int) -> int:
    """A seed that kernels can take."""
    if seed >= 2**63:
        raise typer.BadParameter(f"{seed} is larger than a seed can be, 2^63 - 1")
    return seed


SeedOption = Annotated[int, typer.Option(metavar="N", help="Seed of every random choice.", min=0, callback=_countable)]
JsonOption = Annotated[bool, typer.Option("--json", help="Answer in JSON (mm, s, deg).")]
