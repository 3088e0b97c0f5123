"""Write commands and options into ``docs/command-line.md``, from the app itself: ``python docs/commands.py``."""

import inspect
import re
import sys
import typing
from collections.abc import Callable
from pathlib import Path
from typing import Any

PAGE = Path(__file__).parent / "command-line.md"
BEGIN = "<!-- from here on written by docs/commands.py -->\n"
_KINDS = {str: "TEXT", int: "N", float: "X", Path: "FILE"}  # of what has no name of its own


def listing() -> str:
    """Every command: what it does, its examples, its arguments and options."""
    from fiberplan.cli.app import app
    from fiberplan.cli.examples import EXAMPLES

    functions = [command.callback for command in app.registered_commands]
    return "\n".join(_section(function, EXAMPLES[function.__name__]) for function in functions if function)


def _section(function: Callable, examples: tuple[tuple[str, str], ...]) -> str:
    wide = max(len(line) for line, _ in examples)
    shown = "\n".join(f"{line:<{wide}}  # {what}" for line, what in examples)
    hints = typing.get_type_hints(function, include_extras=True)
    parameters = inspect.signature(function).parameters.values()
    rows = [_row(p.name, *typing.get_args(hints[p.name])[:2], p.default) for p in parameters]
    about = "\n\n".join(" ".join(part.split()) for part in (inspect.getdoc(function) or "").split("\n\n"))
    table = "\n".join(("", "| given as | meaning | otherwise |", "|---|---|---|", *rows, "")) if rows else ""
    return f"### {function.__name__}\n\n{about}\n\n```\n{shown}\n```\n{table}"


def _row(name: str, kind: Any, info: Any, default: Any) -> str:
    """A line of the table; in an annotation, `info.default` is the first of an option's names."""
    names = [each for each in (info.default, *(info.param_decls or ())) if str(each).startswith("-")]
    option = type(info).__name__ == "OptionInfo"
    shown = ", ".join(f"`{each}`" for each in names or ([f"--{name.replace('_', '-')}"] if option else []))
    value = "" if bool in (kind, *typing.get_args(kind)) else f"`{info.metavar or _kind(kind)}`"
    given = (
        "required"
        if default is inspect.Parameter.empty
        else ""
        if default is None or default is False or default == Path()
        else default
    )
    cells = (f"{shown} {value}".strip(), info.help or "", f"{given}")
    return "| " + " | ".join(cell.replace("|", r"\|") for cell in cells) + " |"


def _kind(kind: Any) -> str:
    """What a value looks like."""
    some = [each for each in typing.get_args(kind) if each is not type(None)]
    if typing.get_origin(kind) is typing.Literal:
        return "|".join(some)
    if some:
        return _kind(some[0])
    members = getattr(kind, "__members__", None)
    return "|".join(member.value for member in members.values()) if members else _KINDS[kind]


def written(text: str) -> str:
    """The page with its commands written anew."""
    head, mark, _ = text.partition(BEGIN)
    return f"{head}{mark}\n{re.sub(r' +$', '', listing(), flags=re.MULTILINE)}"


if __name__ == "__main__":
    sys.path.insert(0, str(PAGE.parents[1] / "src"))
    PAGE.write_text(written(PAGE.read_text()))
