"""One compile policy for every kernel.

Kernels take numbers and arrays (a NamedTuple of arrays at most), never raise, and are compiled lazily, so that
read-only arrays are accepted. ``error_model="numpy"``: division by zero gives inf or NaN, and a NaN clearance counts
as contact. Never ``fastmath``: it would let the compiler assume that NaN does not exist.

With NUMBA_DISABLE_JIT=1 kernels are the Python functions they are written as, slow, for a debugger or a coverage run.
"""

import functools
import logging
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit
from numba.core import config, event

from fiberplan.kernels.kernel_cache import KernelCache, folders, writable

_SWITCHED_OFF = bool(getattr(config, "DISABLE_JIT", 0))
if _SWITCHED_OFF:
    np.seterr(all="ignore")  # compiled arithmetic is silent, and unsigned numbers wrap around on purpose


def kernel(function: Callable, **options: bool) -> Callable:
    """Compile `function` for the machine, kept on disk where some folder can be written."""
    compile_: Callable = functools.partial(njit, nogil=True, error_model="numpy", **options)
    compiled = compile_()(function)
    if not _SWITCHED_OFF:
        try:
            compiled._cache = KernelCache(function, options)
        except OSError:  # no source to tell stale from fresh by: compile in memory, every run
            KernelCache.lost += 1
    return compiled


def record(fields: list[tuple]) -> np.dtype:
    """A record of (name, type[, shape]) whose fields kernels read as attributes, compiled or not.

    Records, not one array a field: a kernel call counts references to every array it is handed.
    """
    return np.dtype((np.record, np.dtype(fields, align=True)))


def leaf(function: Callable) -> Callable:
    """A kernel that allocates nothing, so that references to the arrays it is handed need no counting.

    Counting them is most of the cost of a short kernel: the turn of an arm that need not look around takes 5 ns
    without and 66 ns with it. Allocating in a leaf is a compile-time error.
    """
    return kernel(function, _nrt=False)


def inlined(function: Callable) -> Callable:
    """A leaf that is always compiled into its callers: for small ones in hot loops, where a call costs as much."""
    return kernel(function, _nrt=False, forceinline=True)


class _Log(event.Listener):
    """Tells the log of each of our kernels that is compiled."""

    def on_start(self, event: Any) -> None:
        function = getattr((event.data or {}).get("dispatcher"), "py_func", None)
        if function is not None and function.__module__.startswith("fiberplan."):
            _logger.debug("compiling %s of %s", function.__name__, function.__module__)

    def on_end(self, event: Any) -> None:
        pass


_logger = logging.getLogger(__name__)
event.register("numba:compile", _Log())


class _FirstCompilation(event.Listener):
    """Calls `say` once, when the first kernel has to be compiled (nothing is said when the cache serves it)."""

    def __init__(self, say: Callable[[], None]):
        self._say = say
        self._said = False

    def on_start(self, event: Any) -> None:
        if not self._said:
            self._said = True
            self._say()

    def on_end(self, event: Any) -> None:
        pass


@contextmanager
def compilation_notice() -> Iterator[None]:
    """Within this context, tell on stderr when kernels are being compiled instead of leaving the user to wonder."""

    def say() -> None:
        tried = folders(Path(__file__))
        if any(writable(folder) for folder in tried):
            message = "compiling kernels (first run only, a few minutes)..."
        else:
            message = (
                "compiling kernels, a few minutes, on every run: no folder for the cache can be written "
                f"(tried {', '.join(map(str, tried))}); set NUMBA_CACHE_DIR to one that can"
            )
        print(message, file=sys.stderr, flush=True)

    with event.install_listener("numba:compile", _FirstCompilation(say)):
        yield
