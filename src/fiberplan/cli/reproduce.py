"""``fiberplan reproduce``: a paper's figures beside ours."""

import importlib
import pkgutil
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fiberplan.cli.answers import say_json
from fiberplan.cli.completion import beginning
from fiberplan.cli.options import JsonOption
from fiberplan.cli.output import made_folder, say, working
from fiberplan.errors import FiberplanError

if TYPE_CHECKING:
    from fiberplan.reproductions.rows import Row


def _paper_names(incomplete: str) -> list[str]:
    return beginning(incomplete, paper_keys())


def reproduce(
    paper: Annotated[
        str | None,
        typer.Argument(
            metavar="[PAPER]", help="A paper's key; without one, they are listed.", autocompletion=_paper_names
        ),
    ] = None,
    trials: Annotated[int, typer.Option(metavar="N", help="Trials per setting; the papers ran more.", min=1)] = 20,
    json: JsonOption = False,
    folder: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="DIR", help="Write figures as PNG here.")
    ] = None,
) -> None:
    """Run a paper's experiments and print each quantity: the paper's value, ours, and over how many trials."""
    papers = paper_keys()
    if paper is None:
        say_json(papers) if json else say("\n".join(papers))
        return
    if paper not in papers:
        raise FiberplanError(f"no paper '{paper}' to reproduce; there are {', '.join(papers)}")
    if folder is not None:
        made_folder(folder)
    with working(f"reproducing {paper}"):
        experiment = importlib.import_module(f"fiberplan.reproductions.{paper}")
        rows = experiment.run(trials, folder)
    if json:
        say_json(rows)
        return
    from rich.table import Table

    table = Table("quantity", "paper", "ours", "n")
    for row in rows:
        published = row["paper"]
        shown = "" if published is None else f"{published:g}" if isinstance(published, float) else published
        table.add_row(row["quantity"], shown, _ours(row), str(row["n"]))
    say(table)
    say(experiment.LEGEND)


def _ours(row: "Row") -> str:
    """Our value, with its spread where it has one."""
    if row["ours"] is None:
        return "none"
    spread = "" if row["spread"] is None else f" +- {row['spread']:.2g}"
    return f"{row['ours']:.4g}{spread}"


def paper_keys() -> list[str]:
    """Keys of the papers that can be reproduced: modules named after them."""
    import fiberplan.reproductions

    modules = pkgutil.iter_modules(fiberplan.reproductions.__path__)
    return sorted(module.name for module in modules if module.name[-4:].isdigit())
