"""Run the trials of a batch in worker processes on this machine or on a Ray cluster."""

import functools
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import AbstractContextManager, contextmanager, nullcontext
from multiprocessing.connection import Connection, wait
from multiprocessing.synchronize import Semaphore
from typing import Any, Protocol

from experiments.session.signals import SIGNALS, signals_postponed
from experiments.trials.ray_workers import ray_cluster

QUEUED_PER_WORKER = 2  # number of queued calls per worker, kept small so that Ctrl-C takes effect quickly


class _Pool(ProcessPoolExecutor):
    """A pool of processes that block signals, so that a batch can be stopped only by the parent process."""

    @property
    def room(self) -> int:
        return int(self._max_workers * QUEUED_PER_WORKER)  # type: ignore[attr-defined]

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        # Postpone signals too, because another thread can receive a signal that this thread blocks.
        with signals_postponed() as signals:
            before = signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
            try:
                future = super().submit(fn, *args, **kwargs)
            finally:
                signal.pthread_sigmask(signal.SIG_SETMASK, before)
            signals.check()
        return future


@contextmanager
def worker_pool(count: int | None = None) -> Iterator[_Pool]:
    """Start worker processes (default: one per core), which end if the block fails or this process dies."""
    # Spawn the processes, because GL contexts and thread pools do not survive a fork.
    context = multiprocessing.get_context("spawn")
    end_of_work, work = context.Pipe(duplex=False)
    pool = _Pool(count, mp_context=context, initializer=_begin, initargs=(end_of_work, context.Semaphore(1)))
    try:
        yield pool
        pool.shutdown()
    finally:
        work.close()  # ends all worker processes
        pool.shutdown(cancel_futures=True)
        end_of_work.close()


def _begin(end_of_work: Connection, may_print: Semaphore) -> None:
    from experiments.trials.warmup import announce_compiling  # imported late because numba loads slowly

    announce_compiling(lambda: may_print.acquire(block=False))
    _end_with(end_of_work)


def _end_with(end_of_work: Connection) -> None:
    """End this process when its parent process terminates it, closes the connection, or dies."""
    parent = os.getppid()

    def wait_for_end() -> None:
        wait([end_of_work])
        os._exit(1)

    def wait_for_parent() -> None:
        # Since Python 3.12, a pool that has lost a process waits for the processes that it terminates.
        while signal.sigwaitinfo({signal.SIGTERM}).si_pid != parent:
            pass
        os._exit(1)

    for target in (wait_for_end, wait_for_parent):
        threading.Thread(target=target, daemon=True).start()


class Executor(Protocol):
    """An executor for background calls. A call raises `BrokenProcessPool` if its process dies."""

    @property
    def room(self) -> int:
        """The maximum number of running and queued calls."""

    def submit(self, fn: Callable[..., Any], /, *args: Any) -> Future[Any]: ...


PROCESSES, RAY = "processes", "ray"
# A function that creates a new executor each time, so that a batch can continue after a crash
Pools = Callable[[], AbstractContextManager[Executor]]
# The arguments are a number of workers or None, user modules, a callback for messages, and the work folder.
EXECUTORS: Mapping[str, Callable[..., AbstractContextManager[Pools]]] = {
    PROCESSES: lambda workers, *_: nullcontext(functools.partial(worker_pool, workers)),
    RAY: ray_cluster,
}
