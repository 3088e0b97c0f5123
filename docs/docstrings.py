"""Count what docstrings of public names lack: ``python docs/docstrings.py`` lists functions and methods, one a line.

Of everything public and callable: whether arguments beyond the plainest are described, whether what it raises is said
if its own code raises, and whether arrays have a shape and numbers a unit.
"""

import inspect
import re
from collections.abc import Iterator
from typing import Any

import fiberplan as fp

PACKAGES = ("planners", "shaping", "scenes", "instruments", "io", "survey", "hardware", "visuals")
UNITS = re.compile(r"\[(mm|rad|s|deg|rad/s|rad/s2|pixel|inch)\]|\(n,|\(m,|\(2,\)|\(k,")


def functions() -> Iterator[tuple[str, Any]]:
    """Every public function and method, by the name that users write."""
    for name in fp.__all__:
        thing = getattr(fp, name)
        inside = [(f"{name}.{each}", getattr(thing, each)) for each in getattr(thing, "__all__", ())]
        for label, item in inside if name in PACKAGES else [(name, thing)]:
            if inspect.isclass(item):
                methods = {k: v for k, v in vars(item).items() if not k.startswith("_")}
                unwrapped = {k: getattr(v, "__func__", v) for k, v in methods.items()}
                yield from ((f"{label}.{k}", v) for k, v in unwrapped.items() if inspect.isfunction(v))
            elif inspect.isfunction(item):
                yield label, item


def lacks(function: Any) -> Iterator[str]:
    """What is missing in a docstring."""
    said, code = inspect.getdoc(function) or "", inspect.getsource(function)
    if not said:
        yield "docstring"
    if re.search(r"^\s+raise \w", code, re.MULTILINE) and "Raises:" not in said:
        yield "errors"
    arrays = [p for p in inspect.signature(function).parameters.values() if "ndarray" in str(p.annotation)]
    if arrays and not UNITS.search(said):
        yield "shapes or units"
    if len(inspect.signature(function).parameters) > 3 and "Args:" not in said:
        yield "arguments"


def lacking() -> dict[str, list[str]]:
    """What is missing, by name; empty where nothing is."""
    return {name: list(lacks(function)) for name, function in functions()}


if __name__ == "__main__":
    found = lacking()
    for name, missing in found.items():
        if missing:
            print(f"{name}: {', '.join(missing)}")
    print(f"{sum(map(bool, found.values()))} of {len(found)} public functions and methods lack something")
