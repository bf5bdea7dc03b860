"""Worker processes. They are forked from a `multiprocessing` fork server that has preloaded the house."""

import asyncio
import multiprocessing
import os
import socket
import time
from contextlib import suppress
from multiprocessing import forkserver
from pathlib import Path
from typing import Any

from experiments.web.protocol import HOUSE, LENGTH, decode_from_worker, packed
from experiments.web.state import WireMessage

PRELOADED = "experiments.web.worker.preload"
SETTINGS = {
    "MALLOC_ARENA_MAX": "1",  # with one heap per thread, each thread would keep its peak memory
    "LP_NUM_THREADS": "1",  # one thread for the software renderer, because many workers share the machine
}
END_TIMEOUT = 5.0  # timeout for a process to exit, in seconds
RETRY = 0.1  # delay before retrying to start a worker, in seconds


class WorkerProcess:
    """A worker process and its socket. The constructor blocks, so run it in a thread. Then call `connect`.

    The event loop reads the socket, because threads for the sockets of 50 workers delayed the loop by 60 ms.
    """

    def __init__(self) -> None:
        context = multiprocessing.get_context("forkserver")
        self._socket, theirs = socket.socketpair()
        self._process = context.Process(target=_run_worker, args=(theirs,), daemon=True)
        try:
            self._process.start()
        finally:
            theirs.close()

    async def connect(self) -> None:
        """Open the connection in the running event loop."""
        self._loop = asyncio.get_running_loop()
        self._reader, self._writer = await asyncio.open_connection(sock=self._socket)

    def send(self, message: WireMessage) -> None:
        """Queue a message for the worker. If the worker has died, only `receive` reports this."""
        if not self._writer.is_closing():
            self._writer.write(packed(message))

    async def receive(self) -> Any:
        """Return the next message, or None if the worker has died."""
        try:
            (length,) = LENGTH.unpack(await self._reader.readexactly(LENGTH.size))
            return decode_from_worker(await self._reader.readexactly(length))
        except (EOFError, OSError):
            return None

    def processor_time(self) -> float | None:
        """Return the CPU time of the process in seconds, or None if it is unknown."""
        try:
            fields = Path(f"/proc/{self._process.pid}/stat").read_text().rsplit(")", 1)[1].split()
        except OSError:
            return None
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def end(self) -> None:
        """Terminate the process and wait for it. No input is lost, because acknowledged inputs are in the journal."""
        self._process.terminate()
        self._process.join(END_TIMEOUT)
        self._process.kill()
        self._process.join()
        with suppress(RuntimeError):  # raised if the event loop has been closed
            self._loop.call_soon_threadsafe(self._writer.close)


class WorkerPool:
    """A pool of workers that share a preloaded house. Workers load other houses when needed."""

    def __init__(self, house: str) -> None:
        os.environ.update({**SETTINGS, HOUSE: house})  # inherited by child processes
        self._ending: set[asyncio.Future[None]] = set()

    def warm_up(self) -> None:
        multiprocessing.set_forkserver_preload([PRELOADED])
        forkserver.ensure_running()

    async def start(self) -> WorkerProcess:
        """Start a worker. Failed attempts are repeated for several seconds.

        Retries are needed because a killed fork server accepts connections until it is replaced.
        """
        until = time.monotonic() + END_TIMEOUT
        while True:
            starting = asyncio.ensure_future(_started_worker())
            try:
                return await asyncio.shield(starting)
            except asyncio.CancelledError:
                starting.add_done_callback(self._discard_started)  # the starting thread cannot be cancelled
                raise
            except (EOFError, ConnectionError) as error:
                if time.monotonic() > until:
                    raise OSError("the fork server ended") from error
            await asyncio.sleep(RETRY)

    def discard(self, worker: WorkerProcess) -> None:
        """End a worker without waiting for it."""
        ending = asyncio.ensure_future(asyncio.to_thread(worker.end))
        self._ending.add(ending)
        ending.add_done_callback(self._ending.discard)

    def _discard_started(self, starting: asyncio.Future[WorkerProcess]) -> None:
        if not starting.cancelled() and starting.exception() is None:
            self.discard(starting.result())

    async def close(self) -> None:
        await asyncio.gather(*self._ending)


async def _started_worker() -> WorkerProcess:
    worker = await asyncio.to_thread(WorkerProcess)
    await worker.connect()
    return worker


def _run_worker(connection: socket.socket) -> None:
    from experiments.web.worker.main import Worker  # imported here because only workers need it

    Worker(connection).run()
