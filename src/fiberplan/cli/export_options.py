"""How a plan will be exported, as ``key=value``: the options that a controller's `write` takes."""

import inspect
from collections.abc import Callable, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, Literal, get_args, get_origin, get_type_hints

from fiberplan.cli.settings import assigned, converted
from fiberplan.errors import FiberplanError
from fiberplan.tables.wording import nearest

_PLANNED = ("plan", "path")  # what every `write` is given


def export_options(controller: str | None, assignments: Sequence[str]) -> dict[str, Any]:
    """Options for a controller, of assignments such as ``power=0.5``.

    Raises:
        FiberplanError: no controller, one without such an option, or a value that is none of it; one line names it.
    """
    if not assignments:
        return {}
    if controller is None:
        raise FiberplanError(f"--export {assignments[0]}: of which controller? Say --for, too")
    from fiberplan.hardware import CONTROLLERS

    known = _options(CONTROLLERS.find(controller).write)
    given: dict[str, Any] = {}
    for key, text in assigned(assignments, "--export", "fiberplan export --help").items():
        if not text:
            raise FiberplanError(f"--export {key}=: expected a value")
        if key not in known:
            near = nearest(key, known)
            has = f"it has {', '.join(known)}{near}" if known else "it has none"
            raise FiberplanError(f"--export {key}: '{controller}' has no such option; {has}")
        given[key] = _value(text, known[key], f"--export {key}")
    return given


def _options(write: Callable[..., Any]) -> dict[str, Any]:
    """The options of a `write`, and what may be said of each: its annotation, or the kind of its default."""
    try:
        hints = get_type_hints(write)
    except Exception:  # names that are not there: another package's
        hints = {}
    named = (inspect.Parameter.KEYWORD_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)
    each = [one for one in inspect.signature(write).parameters.values() if one.kind in named]
    return {one.name: hints.get(one.name, type(one.default)) for one in each if one.name not in _PLANNED}


def _value(text: str, hint: Any, what: str) -> Any:
    """What text says of an option; where that may be many things, the first of truth, number, path and word."""
    if get_origin(hint) is Literal:
        choices = [str(choice) for choice in get_args(hint)]
        if text not in choices:
            raise FiberplanError(f"{what}={text}: expected one of {', '.join(choices)}")
        return get_args(hint)[choices.index(text)]
    kinds = get_args(hint) or (hint,)
    for kind in (bool, int, float):
        if kind in kinds:
            return converted(text, kind, what)
    return Path(text) if Path in kinds or PathLike in kinds else text
