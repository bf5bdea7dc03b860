"""What runs the trials of a batch: processes of this machine that end with their parent, or a Ray cluster."""

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

QUEUED_PER_WORKER = 2  # few, so that Ctrl-C has little to wait for


class _Pool(ProcessPoolExecutor):
    """Its processes begin with signals blocked, and keep them so: what stops a batch is up to the parent."""

    @property
    def room(self) -> int:
        """Maximum number of calls under way."""
        return int(self._max_workers * QUEUED_PER_WORKER)  # type: ignore[attr-defined]

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        with signals_postponed() as signals:  # another thread may take a signal that this one blocks
            before = signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
            try:
                future = super().submit(fn, *args, **kwargs)
            finally:
                signal.pthread_sigmask(signal.SIG_SETMASK, before)
            signals.check()
        return future


@contextmanager
def worker_pool(count: int | None = None) -> Iterator[_Pool]:
    """Worker processes, by default one per core. They end at once where the block raises or this process is killed."""
    # Spawned, not forked: a forked GL context or thread pool does not work.
    context = multiprocessing.get_context("spawn")
    end_of_work, work = context.Pipe(duplex=False)
    pool = _Pool(count, mp_context=context, initializer=_begin, initargs=(end_of_work, context.Semaphore(1)))
    try:
        yield pool
        pool.shutdown()
    finally:
        work.close()  # all workers see it
        pool.shutdown(cancel_futures=True)
        end_of_work.close()


def _begin(end_of_work: Connection, voice: Semaphore) -> None:
    """Begin to work: one of the workers says it if kernels are compiled, all end with their parent."""
    from experiments.trials.warmup import announce_compiling  # numba takes a while to load

    announce_compiling(lambda: voice.acquire(block=False))
    _end_with(end_of_work)


def _end_with(end_of_work: Connection) -> None:
    """End this process when its parent terminates it, or closes the other end of the connection, also by its death."""
    parent = os.getppid()

    def wait_for_end() -> None:
        wait([end_of_work])
        os._exit(1)

    def wait_for_parent() -> None:
        # From Python 3.12 on, a pool that has lost a process waits until those that it terminates have ended.
        while signal.sigwaitinfo({signal.SIGTERM}).si_pid != parent:
            pass
        os._exit(1)

    for target in (wait_for_end, wait_for_parent):
        threading.Thread(target=target, daemon=True).start()


class Executor(Protocol):
    """Runs calls in the background. A call whose process dies raises `BrokenProcessPool`."""

    @property
    def room(self) -> int:
        """Maximum number of calls under way."""

    def submit(self, fn: Callable[..., Any], /, *args: Any) -> Future[Any]:
        """Start a call."""


PROCESSES, RAY = "processes", "ray"
Pools = Callable[[], AbstractContextManager[Executor]]  # makes a new executor after a process has died
# Name -> context, for a number of workers or None, user modules, a callback for notes, and the batch's work folder.
EXECUTORS: Mapping[str, Callable[..., AbstractContextManager[Pools]]] = {
    PROCESSES: lambda workers, *_: nullcontext(functools.partial(worker_pool, workers)),
    RAY: ray_cluster,
}
