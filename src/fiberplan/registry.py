"""What lies above is found by name: the functions of `fiberplan.io` that classes offer as methods.

Imports run downward, yet `FocalPlane.load` has to end in the reader of some instrument's files. Such a method asks here
when it is called, so that no class imports what is built on it.
"""

import importlib
from collections.abc import Callable
from typing import Any


def io_function(name: str) -> Callable[..., Any]:
    """A function of `fiberplan.io`."""
    return getattr(importlib.import_module("fiberplan.io"), name)
