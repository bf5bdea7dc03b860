"""Workers of a batch: processes on this machine, which end with their parent, or a Ray cluster."""

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

QUEUED_PER_WORKER = 2  # a small number, so that Ctrl-C takes effect soon


class _Pool(ProcessPoolExecutor):
    """A pool whose processes block signals, so that only the parent process can stop a batch."""

    @property
    def room(self) -> int:
        return int(self._max_workers * QUEUED_PER_WORKER)  # type: ignore[attr-defined]

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        # Another thread may still receive a signal that is blocked in this one
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
    """Start worker processes, by default one per core. They end at once if the block raises or this process dies."""
    # Processes are spawned, because GL contexts and thread pools do not survive a fork.
    context = multiprocessing.get_context("spawn")
    end_of_work, work = context.Pipe(duplex=False)
    pool = _Pool(count, mp_context=context, initializer=_begin, initargs=(end_of_work, context.Semaphore(1)))
    try:
        yield pool
        pool.shutdown()
    finally:
        work.close()  # ends all workers
        pool.shutdown(cancel_futures=True)
        end_of_work.close()


def _begin(end_of_work: Connection, may_print: Semaphore) -> None:
    from experiments.trials.warmup import announce_compiling  # imported late because numba loads slowly

    announce_compiling(lambda: may_print.acquire(block=False))
    _end_with(end_of_work)


def _end_with(end_of_work: Connection) -> None:
    """End this process when its parent terminates it, closes the other end of the connection, or dies."""
    parent = os.getppid()

    def wait_for_end() -> None:
        wait([end_of_work])
        os._exit(1)

    def wait_for_parent() -> None:
        # From Python 3.12, a pool that has lost a process waits for the processes that it terminates.
        while signal.sigwaitinfo({signal.SIGTERM}).si_pid != parent:
            pass
        os._exit(1)

    for target in (wait_for_end, wait_for_parent):
        threading.Thread(target=target, daemon=True).start()


class Executor(Protocol):
    """Runs calls in the background. A call whose process dies raises `BrokenProcessPool`."""

    @property
    def room(self) -> int:
        """Maximum number of running and queued calls."""

    def submit(self, fn: Callable[..., Any], /, *args: Any) -> Future[Any]: ...


PROCESSES, RAY = "processes", "ray"
Pools = Callable[
    [], AbstractContextManager[Executor]
]  # makes a new executor each time, so that a batch can continue after a crash
# Arguments: number of workers or None, user modules, callback for messages, and work folder of the batch
EXECUTORS: Mapping[str, Callable[..., AbstractContextManager[Pools]]] = {
    PROCESSES: lambda workers, *_: nullcontext(functools.partial(worker_pool, workers)),
    RAY: ray_cluster,
}
