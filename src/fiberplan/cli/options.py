"""Arguments and options that several commands share, with their units."""

from pathlib import Path
from typing import Annotated

import typer

PlanArgument = Annotated[Path, typer.Argument(metavar="PLAN", help="A plan written by `fiberplan plan`.")]
SeedOption = Annotated[int, typer.Option(metavar="N", help="Seed of every random choice.", min=0, max=2**63 - 1)]
JsonOption = Annotated[bool, typer.Option("--json", help="Answer in JSON (mm, s, deg).")]
