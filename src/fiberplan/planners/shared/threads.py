"""Work on many positioners, or pairs, at once, by as many threads as there are cores: kernels hold no lock.

Only for work in which none has a part in another's, so that the result is the same for any number of threads.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from fiberplan.cores import cores

_LEAST = 500  # positioners or pairs that are worth a thread


def in_parts_at_once(work: Callable[[np.ndarray], None], who: np.ndarray) -> None:
    """Call `work` for parts of `who` (m,) at the same time, one for each core, or one for a few hundred."""
    parts = np.array_split(who, max(1, min(cores(), len(who) // _LEAST)))
    if len(parts) == 1:
        work(who)
        return
    with ThreadPoolExecutor(len(parts)) as pool:
        for done in [pool.submit(work, part) for part in parts]:
            done.result()
