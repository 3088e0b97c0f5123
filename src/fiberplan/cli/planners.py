"""``fiberplan planners``: which there are, and what can be set."""

import inspect
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fiberplan.cli.answers import say_json
from fiberplan.cli.completion import planner_names
from fiberplan.cli.options import JsonOption
from fiberplan.cli.output import say
from fiberplan.errors import FiberplanError

if TYPE_CHECKING:
    from fiberplan.cli.settings import Setting


def planners(
    name: Annotated[
        str | None, typer.Argument(metavar="[NAME]", help="A planner.", autocompletion=planner_names)
    ] = None,
    json: JsonOption = False,
) -> None:
    """List the planners, or what can be set of one: each setting's key, unit, default and meaning."""
    from rich.table import Table

    from fiberplan.cli.settings import settings_of, shown
    from fiberplan.planners import PLANNERS

    if name is None:
        known = [_row(each) for each in PLANNERS]
        if json:
            say_json(known)
            return
        table = Table("name", "reference", "what it does")
        for row in known:
            table.add_row(row["name"], row["reference"], row["about"])
        say(table)
        say("`fiberplan planners NAME` lists what can be set; direct is taken unless --planner names another.")
        return
    make = PLANNERS.find(name)
    settings = settings_of(make)
    about = {"name": name, "reference": getattr(make, "reference", ""), "about": _about(make)}
    if json:
        say_json(about | {"settings": [_facts(setting) for setting in settings.values()]})
        return
    say(f"{name}: {about['about']}", style="bold")
    say(f"reference: {about['reference']}")
    table = Table("key", "default", "unit", "what it is")
    for setting in settings.values():
        choices = f" ({setting.expected})" if setting.choices else ""
        table.add_row(setting.key, shown(setting.default), setting.unit, f"{setting.help}{choices}".strip())
    say(table)
    say("Each is given by --set key=value, or by a line `key = value` in the TOML file that --settings names.")


def _row(name: str) -> dict[str, str]:
    """Name, source and one line about a planner; of one that cannot be imported, why."""
    from fiberplan.planners import PLANNERS

    try:
        make = PLANNERS[name]
    except FiberplanError as error:
        return {"name": name, "reference": "", "about": str(error)}
    return {"name": name, "reference": getattr(make, "reference", ""), "about": _about(make)}


def _about(make: Callable[..., Any]) -> str:
    """The first line of its docstring; nothing if that is the one which a dataclass makes up."""
    text = inspect.getdoc(make) or ""
    return "" if text.startswith(f"{getattr(make, '__name__', '')}(") else text.partition("\n")[0]


def _facts(setting: "Setting") -> dict[str, Any]:
    return {
        "key": setting.key,
        "type": setting.kind.__name__,
        "choices": setting.choices,
        "optional": setting.optional,
        "unit": setting.unit,
        "default": setting.default,
        "help": setting.help,
    }
