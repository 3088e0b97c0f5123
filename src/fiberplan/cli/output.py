"""What the commands print and where they write: answers on stdout, errors and progress on stderr.

On a terminal long work shows a bar; in a pipe nothing but the answer is printed. A reader that goes away
(``fiberplan verify plan.fits | head -1``) changes neither what is written nor the exit code.
"""

import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console, RenderableType

from fiberplan.errors import FiberplanError

WIDE = 160  # columns of a table in a pipe


class _Patient(Console):
    """A console that goes quiet, not away, when its reader does."""

    def on_broken_pipe(self) -> None:
        """Send what is still to come to nowhere."""
        self.quiet = True
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)


def say(what: RenderableType, style: str | None = None) -> None:
    """Print an answer: text as it stands, one line a line, or a table."""
    console = _Patient(highlight=False, markup=False, emoji=False, width=None if sys.stdout.isatty() else WIDE)
    console.print(what, style=style if console.is_terminal else None, soft_wrap=isinstance(what, str))


def complain(message: str) -> None:
    """Print one line on stderr."""
    print(f"fiberplan: error: {' '.join(message.split())}", file=sys.stderr, flush=True)


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


def refuse_unwritable(*outputs: Path | None, inputs: tuple[Path | None, ...] = ()) -> None:
    """Before any work: can every output be written, is each a file of its own, and is none of them an input?

    Raises:
        FiberplanError: naming the first output that cannot.
    """
    taken = {path.resolve(): "an input" for path in inputs if path is not None and path.exists()}
    for path in outputs:
        if path is None:
            continue
        if path.is_dir():
            raise FiberplanError(f"{path} is a folder, not a file")
        if path.resolve() in taken:
            raise FiberplanError(f"{path} is {taken[path.resolve()]} of this command already")
        taken[path.resolve()] = "an output"
        refuse_folder(path.parent, path)


def refuse_folder(folder: Path, output: Path) -> None:
    """Can a file be made in `folder`?

    Raises:
        FiberplanError: the folder does not exist, is not one, or may not be written to.
    """
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise FiberplanError(f"{output} cannot be written: folder {folder}: {reason}") from None


def made_folder(folder: Path) -> Path:
    """`folder`, made if need be, that files can be written to.

    Raises:
        FiberplanError: it cannot.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FiberplanError(f"folder {folder} cannot be made: {(error.strerror or str(error)).lower()}") from None
    refuse_folder(folder, folder)
    return folder
