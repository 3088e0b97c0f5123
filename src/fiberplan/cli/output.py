"""What the commands print and where they write: answers on stdout, errors and progress on stderr.

On a terminal long work shows a bar; in a pipe nothing but the answer is printed. A reader that goes away
(``fiberplan verify plan.fits | head -1``) changes neither what is written nor the exit code.
"""

import io
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from rich.console import Console, RenderableType
from rich.text import Text

from fiberplan.errors import FiberplanError
from fiberplan.tables.atomic import is_special, refuse_folder, refuse_unwritable_place

WIDE = 160  # columns of a table in a pipe
_CONTROLS = {k: f"\\x{k:02x}" for k in (*range(32), *range(127, 160)) if chr(k) not in "\n\t"}


def visible(text: str) -> str:
    """A text without what a terminal obeys: names and cells come from files, whoever wrote these."""
    return text.translate(_CONTROLS)


class _Patient(Console):
    """A console that goes quiet, not away, when its reader does, and shows control characters as what they are."""

    def render_str(self, text: str, **how: Any) -> Text:
        """As any console does, without what a terminal obeys."""
        return super().render_str(visible(text), **how)

    def on_broken_pipe(self) -> None:
        """Send what is still to come to nowhere."""
        self.quiet = True
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)


class Output(NamedTuple):
    """A file that a command writes."""

    path: Path | None  #: None: not asked for
    suffixes: tuple[str, ...]  #: the endings it may have; the first is the usual one
    what: str  #: what is written, in words


def plan_output(path: Path | None) -> Output:
    """A plan to write."""
    return Output(path, (".fits",), "a plan")


def page_output(path: Path | None) -> Output:
    """A page to write."""
    return Output(path, (".html", ".htm"), "an HTML page")


def say(what: RenderableType, style: str | None = None) -> None:
    """Print an answer: text as it stands, one line a line, or a table; letters that stdout has not are escaped."""
    if isinstance(sys.stdout, io.TextIOWrapper) and sys.stdout.errors != "backslashreplace":
        sys.stdout.reconfigure(errors="backslashreplace")
    console = _Patient(highlight=False, markup=False, emoji=False, width=None if sys.stdout.isatty() else WIDE)
    console.print(what, style=style if console.is_terminal else None, soft_wrap=isinstance(what, str))


def complain(message: str) -> None:
    """Print one line on stderr."""
    print(f"fiberplan: error: {visible(' '.join(message.split()))}", file=sys.stderr, flush=True)


@contextmanager
def working(what: str) -> Iterator[Callable[[str], None]]:
    """Show a bar on a terminal while `what` is being done, and say so if kernels have to be compiled first.

    What it yields is to be told how far things are.
    """
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    from fiberplan.kernels.compile import compilation_notice

    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task(what, total=None)
        with compilation_notice():
            yield lambda how_far: progress.update(task, description=f"{what}: {how_far}")


def refuse_unwritable(*outputs: Output, inputs: tuple[Path | None, ...] = ()) -> None:
    """Before any work: can every output be written, does it end as what it is, and is it a file of its own?

    Raises:
        FiberplanError: naming the first output that cannot.
    """
    taken = {_identity(path): "an input" for path in inputs if path is not None and path.exists()}
    for path, suffixes, what in outputs:
        if path is None:
            continue
        if str(path) == "-":
            raise FiberplanError("-: stdout carries the answer in words; name a file (./- for one that is called -)")
        if path.is_dir():
            raise FiberplanError(f"{path} is a folder, not a file")
        refuse_unwritable_place(path, FiberplanError)
        if is_special(path):
            continue
        if path.suffix and path.suffix.lower() not in suffixes:
            raise FiberplanError(f"{path}: this command writes {what}, which ends in {' or '.join(suffixes)}")
        if _identity(path) in taken:
            raise FiberplanError(f"{path} is {taken[_identity(path)]} of this command already")
        taken[_identity(path)] = "an output"


def _identity(path: Path) -> object:
    """What two names of one file have in common: hard links have one node, files to come one real path."""
    try:
        status = path.stat()
    except OSError:
        return os.path.realpath(path)
    return status.st_dev, status.st_ino


def made_folder(folder: Path) -> Path:
    """`folder`, made if need be, that files can be written to.

    Raises:
        FiberplanError: it cannot.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FiberplanError(f"folder {folder} cannot be made: {(error.strerror or str(error)).lower()}") from None
    refuse_folder(folder, folder, FiberplanError)
    return folder
