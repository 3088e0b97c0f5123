"""Who does the fields: this process, other processes of this machine, a Dask cluster, or any executor.

A local worker is a process of its own behind an executor of its own: one that dies takes one field with it, nobody has
to guess which, and another takes its place. Workers ignore Ctrl-C, which is for whoever started them, and end when that
process is gone, however it went. Kernels are loaded once by each, for its first field.
"""

import contextlib
import multiprocessing
import os
import pickle
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from multiprocessing.connection import wait
from queue import SimpleQueue
from typing import Any

from fiberplan.cores import cores
from fiberplan.errors import FiberplanError
from fiberplan.survey.batch.work import Packed, Setup

_KILLED = "KilledWorker"  # what distributed raises for a task whose workers died again and again


def packed(setup: Setup, name: str) -> Packed:
    """A setup to send to workers."""
    return Packed(name, pickle.dumps(setup))


class Here(Executor):
    """This process: a field is done when it is handed over."""

    def submit(self, fn: Callable, /, *args: Any, **kwargs: Any) -> Future:
        """Do it now."""
        future: Future = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:  # as any executor: whoever asks for the result gets it
            future.set_exception(error)
        return future


class LocalProcesses(Executor):
    """So many processes of this machine, told about the setup once, when they start."""

    def __init__(self, count: int, setup: Packed):
        self._setup = setup
        self._free: SimpleQueue[ProcessPoolExecutor] = SimpleQueue()
        self._pools: set[ProcessPoolExecutor] = set()
        self._pids: dict[ProcessPoolExecutor, Future[int]] = {}
        for _ in range(count):
            self._add()

    def _add(self) -> None:
        context = multiprocessing.get_context("spawn")  # no copy of our threads' locks
        pool = ProcessPoolExecutor(1, context, _begin, (self._setup,))
        self._pools.add(pool)
        self._free.put(pool)

    def submit(self, fn: Callable, /, *args: Any, **kwargs: Any) -> Future:
        """Do it as soon as a process is free."""
        pool = self._free.get()
        if pool not in self._pids:
            self._pids[pool] = pool.submit(os.getpid)
        future = pool.submit(fn, *args, **kwargs)
        future.add_done_callback(lambda done: self._give_back(pool, done))
        return future

    def _give_back(self, pool: ProcessPoolExecutor, done: Future) -> None:
        if not done.cancelled() and isinstance(done.exception(), BrokenExecutor):
            self._pools.discard(pool)
            self._pids.pop(pool, None)
            pool.shutdown(wait=False)
            self._add()
        else:
            self._free.put(pool)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End all processes, also in the middle of a field: nothing of it is kept."""
        for pool, pid in list(self._pids.items()):
            if pid.done() and not pid.cancelled() and pid.exception() is None:
                with contextlib.suppress(ProcessLookupError):
                    os.kill(pid.result(), signal.SIGTERM)
            pool.shutdown(wait=False, cancel_futures=True)


def _begin(setup: Packed) -> None:
    """A process begins: no Ctrl-C, an eye on whoever started it, and the setup."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    assert parent is not None  # started by one
    threading.Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()
    setup.unpacked()


def _end_with(sentinel: int) -> None:
    wait([sentinel])
    os._exit(1)


@contextlib.contextmanager
def dask_executor(address: str | None) -> Iterator[tuple[Executor, int]]:
    """An executor on a Dask cluster, and how many fields it should be given at a time.

    Args:
        address: of its scheduler; a cluster of this machine's cores is started, and ended, if None.

    Raises:
        FiberplanError: the extra is not installed, or there is no such scheduler.
    """
    try:
        from distributed import Client
    except ImportError:
        raise FiberplanError("executor dask needs the extra: pip install 'fiberplan[dask]'") from None
    try:
        client = Client(address) if address is not None else Client(n_workers=cores(), threads_per_worker=1)
    except (OSError, ValueError) as error:
        raise FiberplanError(f"scheduler {address}: {str(error).splitlines()[0]}") from None
    with client:
        there = sum(client.ncores().values())
        yield client.get_executor(pure=False), 2 * max(1, there)


def died(error: BaseException) -> bool:
    """Whether an error of a future says that its worker died or had no memory left, so that another try may do."""
    return isinstance(error, BrokenExecutor | MemoryError) or type(error).__name__ == _KILLED
