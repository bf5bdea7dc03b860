"""Worker processes from the fork server of `multiprocessing`, in which the house and all kernels are loaded."""

import asyncio
import multiprocessing
import os
import socket
import time
from contextlib import suppress
from multiprocessing import forkserver
from pathlib import Path
from typing import Any

from experiments.web.protocol import HOUSE, LENGTH, WireMessage, decode_from_worker, packed

PRELOADED = "experiments.web.worker.preload"
SETTINGS = {
    "MALLOC_ARENA_MAX": "1",  # one heap for each thread would keep what each once needed
    "LP_NUM_THREADS": "1",  # of software rendering; many workers share the machine
}
END_TIMEOUT = 5.0  # s that a process has to end
RETRY = 0.1  # s until a worker is asked for again


class WorkerProcess:
    """A worker process and the socket to it. The constructor waits until it runs, so call it in a thread; then connect.

    Threads that read and write would compete with the event loop for the GIL: with 50 workers it was 60 ms late.
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
        """Open the connection in this event loop."""
        self._loop = asyncio.get_running_loop()
        self._reader, self._writer = await asyncio.open_connection(sock=self._socket)

    def send(self, message: WireMessage) -> None:
        """Send a message, without waiting; if the worker is dead, `receive` reports it."""
        if not self._writer.is_closing():
            self._writer.write(packed(message))

    async def receive(self) -> Any:
        """The next message, or None if the worker is dead."""
        try:
            (length,) = LENGTH.unpack(await self._reader.readexactly(LENGTH.size))
            return decode_from_worker(await self._reader.readexactly(length))
        except (EOFError, OSError):
            return None

    def processor_time(self) -> float | None:
        """Processor time of the process, s; None where it is not known."""
        try:
            fields = Path(f"/proc/{self._process.pid}/stat").read_text().rsplit(")", 1)[1].split()
        except OSError:
            return None
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def end(self) -> None:
        """End the process, and wait for that; the journal keeps what was acknowledged."""
        self._process.terminate()
        self._process.join(END_TIMEOUT)
        self._process.kill()
        self._process.join()
        with suppress(RuntimeError):  # the event loop is closed
            self._loop.call_soon_threadsafe(self._writer.close)


class WorkerPool:
    """Starts and ends workers, which share a loaded house; they load others when they need them."""

    def __init__(self, house: str) -> None:
        os.environ.update({**SETTINGS, HOUSE: house})  # of the processes that this one starts
        self._ending: set[asyncio.Future[None]] = set()

    def warm_up(self) -> None:
        """Start the fork server, unless it runs."""
        multiprocessing.set_forkserver_preload([PRELOADED])
        forkserver.ensure_running()

    async def start(self) -> WorkerProcess:
        """A new worker. A fork server that was just killed still takes connections, until another one replaces it."""
        until = time.monotonic() + END_TIMEOUT
        while True:
            starting = asyncio.ensure_future(_started_worker())
            try:
                return await asyncio.shield(starting)
            except asyncio.CancelledError:
                starting.add_done_callback(self._discard_started)  # it goes on, and nobody wants the worker
                raise
            except (EOFError, ConnectionError) as error:
                if time.monotonic() > until:
                    raise OSError("the fork server ended") from error
            await asyncio.sleep(RETRY)

    def discard(self, worker: WorkerProcess) -> None:
        """End a worker, without waiting for that."""
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
    from experiments.web.worker.main import Worker  # the server never loads it

    Worker(connection).run()
