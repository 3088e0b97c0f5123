"""Work on many positioners, or pairs, at once, by as many threads as there are cores: kernels hold no lock.

Only for work in which none has a part in another's, so that the result is the same for any number of threads.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import TypeVar

import numpy as np

from fiberplan.cores import cores

Result = TypeVar("Result")
_LEAST = 500  # positioners or pairs that are worth a thread


def at_once(calls: Sequence[Callable[[], Result]]) -> list[Result]:
    """What each of `calls` returns, called at the same time, as many as there are cores."""
    most = min(cores(), len(calls))
    if most < 2:
        return [call() for call in calls]
    with ThreadPoolExecutor(most) as pool:
        try:
            return [done.result() for done in [pool.submit(call) for call in calls]]
        except BaseException:  # Ctrl-C, too
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def in_parts_at_once(work: Callable[[np.ndarray], None], who: np.ndarray) -> None:
    """Call `work` for parts of `who` (m,) at the same time, one for each core, or one for a few hundred."""
    parts = np.array_split(who, max(1, min(cores(), len(who) // _LEAST)))
    at_once([partial(work, part) for part in parts])
