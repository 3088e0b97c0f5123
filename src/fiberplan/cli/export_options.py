"""How a plan will be exported, as ``key=value``: the options that a controller's `write` takes."""

import inspect
import types
from collections.abc import Sequence
from pathlib import Path
from typing import Any, get_args, get_type_hints

from fiberplan.cli.settings import converted
from fiberplan.errors import FiberplanError
from fiberplan.tables.wording import nearest


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

    write = CONTROLLERS.find(controller).write
    hints, options = get_type_hints(write), inspect.signature(write).parameters
    known = [name for name, each in options.items() if each.kind is each.KEYWORD_ONLY]
    given: dict[str, Any] = {}
    for assignment in assignments:
        key, equals, text = (part.strip() for part in assignment.partition("="))
        if not (key and equals and text):
            raise FiberplanError(f"--export {assignment}: expected key=value")
        if key not in known:
            near = nearest(key, known)
            raise FiberplanError(f"--export {key}: '{controller}' has no such option; it has {', '.join(known)}{near}")
        if key in given:
            raise FiberplanError(f"--export {key} is given twice")
        given[key] = converted(text, _kind(hints[key]), f"--export {key}")
    return given


def _kind(hint: Any) -> type:
    """What a value of an option is; whatever may be a path is one."""
    kinds = get_args(hint) if isinstance(hint, types.UnionType) else (hint,)
    return next((kind for kind in (bool, int, float) if kind in kinds), Path)
