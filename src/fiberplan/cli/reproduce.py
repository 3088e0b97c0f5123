"""``fiberplan reproduce``: a paper's figures beside ours."""

import importlib
import pkgutil
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fiberplan.cli.answers import say_json
from fiberplan.cli.completion import beginning
from fiberplan.cli.options import JsonOption
from fiberplan.cli.output import Output, made_folder, refuse_unwritable, say, working
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
    every: Annotated[bool, typer.Option("--all", help="All papers, one after the other.")] = False,
    trials: Annotated[int, typer.Option(metavar="N", help="Trials per setting; the papers ran more.", min=1)] = 20,
    json: JsonOption = False,
    folder: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", metavar="DIR", help="Write figures (PNG) here, and index.html, which shows them."
        ),
    ] = None,
) -> None:
    """Run a paper's experiments and print each quantity: the paper's value, ours, and over how many trials."""
    papers = paper_keys()
    if paper is None and not every:
        say_json(papers) if json else say("\n".join(papers))
        return
    if paper is not None and every:
        raise FiberplanError(f"reproduce: either {paper} or --all, not both")
    if paper is not None and paper not in papers:
        raise FiberplanError(f"no paper '{paper}' to reproduce; there are {', '.join(papers)}")
    chosen = papers if paper is None else [paper]
    folders = _folders(folder, chosen, every)
    done: dict[str, tuple[ModuleType, list[Row]]] = {}
    for key in chosen:
        with working(f"reproducing {key}"):
            experiment = importlib.import_module(f"fiberplan.reproductions.{key}")
            done[key] = experiment, experiment.run(trials, folders.get(key))
    if folder is not None:
        from fiberplan.reproductions.gallery import Paper, gallery

        pages = [
            Paper(key, _about(experiment), experiment.LEGEND, experiment.FIGURES, rows, key if every else "")
            for key, (experiment, rows) in done.items()
        ]
        gallery(pages, folder / "index.html", trials)
    if json:
        rows_of: Any = {key: rows for key, (_, rows) in done.items()}
        say_json(rows_of if every else rows_of[chosen[0]])
        return
    for key, (experiment, rows) in done.items():
        _say_rows(key if every else None, rows)
        say(experiment.LEGEND)
    if folder is not None:
        say(f"wrote {folder / 'index.html'}, which shows the figures beside these numbers")


def _folders(folder: Path | None, papers: list[str], every: bool) -> dict[str, Path]:
    """Where each paper's figures go: of all papers, into a folder each."""
    if folder is None:
        return {}
    made_folder(folder)
    refuse_unwritable(Output(folder / "index.html", (".html",), "an HTML page"))
    return {key: made_folder(folder / key) if every else folder for key in papers}


def _about(experiment: ModuleType) -> str:
    """What a paper's package says of itself in its first line."""
    return (experiment.__doc__ or "").strip().splitlines()[0]


def _say_rows(title: str | None, rows: "list[Row]") -> None:
    from rich.table import Table

    from fiberplan.reproductions.rows import ours_in_words, paper_in_words

    table = Table("quantity", "paper", "ours", "n", title=title, title_justify="left")
    for row in rows:
        table.add_row(row["quantity"], paper_in_words(row), ours_in_words(row), str(row["n"]))
    say(table)


def paper_keys() -> list[str]:
    """Keys of the papers that can be reproduced: modules named after them."""
    import fiberplan.reproductions

    modules = pkgutil.iter_modules(fiberplan.reproductions.__path__)
    return sorted(module.name for module in modules if module.name[-4:].isdigit())
