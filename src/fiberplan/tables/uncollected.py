"""Read and write many numbers without looking for garbage in between."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def uncollected() -> Iterator[None]:
    """Within this context, or in what it decorates, the garbage collector rests.

    Lists of numbers hold no cycles; but every few hundred new ones make it look through all objects that there are,
    kernels' and libraries' too, which takes longer than to read them.
    """
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()
