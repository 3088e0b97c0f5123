"""Run what a page of the manual shows: ``python docs/examples.py PAGE...`` runs pages and prints what comes out.

A page is plain Markdown. In the order of the page, in one namespace and one empty folder,

- a ``python`` block is run,
- a block whose first line names a file, as in ``toml file=mine.toml``, is written to that file,
- the lines of a ``sh run`` block that begin with ``fiberplan`` are run as commands; each has to end with exit code 0,
  or with the one that its comment names, as in ``# exit code 1``.

A block is left alone if the line above it is ``<!-- not run: REASON -->``. The tests run every page, and `conf` puts
what is printed, and the figures that are written, below each block of the built manual.
"""

import contextlib
import io
import os
import re
import shlex
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

DOCS = Path(__file__).parent
BLOCK = re.compile(r"(?P<skip><!-- not run: [^>]+ -->\n)?^```(?P<info>\S[^\n]*)\n(?P<code>.*?)^```$", re.M | re.S)
PICTURES = (".svg", ".png", ".gif")


@dataclass(frozen=True)
class Block:
    """A fenced block of a page that does something."""

    kind: str  #: "python", "sh" or "file"
    name: str  #: of the file to write; "" of others
    code: str
    line: int  #: of its first line of code, in the page
    end: int  #: offset of the character after it


def blocks(text: str) -> list[Block]:
    """The blocks of a page that are run, in its order."""
    found = []
    for match in BLOCK.finditer(text):
        words = match["info"].split()
        named = [word.removeprefix("file=") for word in words[1:] if word.startswith("file=")]
        kind = "file" if named else words[0]
        if match["skip"] or not (kind in ("python", "file") or words == ["sh", "run"]):
            continue
        line = text.count("\n", 0, match.start("code")) + 1
        found.append(Block(kind, "".join(named), match["code"], line, match.end()))
    return found


@dataclass(frozen=True)
class Result:
    """What a block did."""

    printed: str
    pictures: tuple[Path, ...]  #: figures that it wrote


def results(page: Path, folder: Path) -> Iterator[Result]:
    """What each block of a page does, one after the other, in `folder`, which is the working directory meanwhile.

    Raises:
        RuntimeError: a command ends with another exit code than the page says.
        Exception: whatever a block raises.
    """
    names: dict = {"__name__": "example"}
    with contextlib.chdir(folder):
        for block in blocks(page.read_text(encoding="utf-8")):
            before = _files(folder)
            told = io.StringIO()
            with contextlib.redirect_stdout(told):
                if block.kind == "file":
                    Path(block.name).write_text(block.code, encoding="utf-8")
                elif block.kind == "python":
                    padded = "\n" * (block.line - 1) + block.code  # so that errors name the line of the page
                    exec(compile(padded, str(page), "exec"), names)
                else:
                    _commands(block, page)
            new = [path for path, age in _files(folder).items() if before.get(path) != age]
            yield Result(told.getvalue(), tuple(path for path in new if path.suffix in PICTURES))


def _files(folder: Path) -> dict[Path, int]:
    return {path: path.stat().st_mtime_ns for path in sorted(folder.rglob("*")) if path.is_file()}


def _commands(block: Block, page: Path) -> None:
    from fiberplan.cli.app import run

    for number, line in enumerate(block.code.splitlines(), block.line):
        command, _, comment = line.partition(" #")
        program, *words = shlex.split(command) or [""]
        if program == "fiberplan":
            code, wanted = run(words), re.search(r"exit code (\d+)", comment)
            if code != (int(wanted[1]) if wanted else 0):
                raise RuntimeError(f"{page}:{number}: exit code {code} of: {command}")


def main(pages: list[str]) -> None:
    """Run pages and print what their blocks print."""
    for page in pages:
        with tempfile.TemporaryDirectory() as folder:
            for result in results(Path(page).resolve(), Path(folder)):
                sys.stdout.write(result.printed)
                for picture in result.pictures:
                    print(f"[{os.path.relpath(picture, folder)}]")


if __name__ == "__main__":
    main(sys.argv[1:])
