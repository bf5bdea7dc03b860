"""Worker processes from the fork server of `multiprocessing`, in which the house and all kernels are loaded."""

import asyncio
import multiprocessing
import os
import queue
import threading
import time
from contextlib import suppress
from multiprocessing import forkserver
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from experiments.web.protocol import WireMessage, decode_from_worker, encode

PRELOADED = "experiments.web.worker.preload"
HOUSE = "MJSIM_PLAY_HOUSE"  # environment variable that it reads
SETTINGS = {
    "MALLOC_ARENA_MAX": "1",  # one heap for each thread would keep what each once needed
    "LP_NUM_THREADS": "1",  # of software rendering; many workers share the machine
}
END_TIMEOUT = 5.0  # s that a process has to end
RETRY = 0.1  # s until a worker is asked for again


class WorkerProcess:
    """A worker process and the connection to it. The constructor waits until it runs, so call it in a thread."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        context = multiprocessing.get_context("forkserver")
        self._connection, theirs = context.Pipe()
        self._process = context.Process(target=_run_worker, args=(theirs,), daemon=True)
        self._process.start()
        theirs.close()
        self._loop = loop
        self._received: asyncio.Queue[Any] = asyncio.Queue()
        self._outgoing: queue.SimpleQueue[WireMessage | None] = queue.SimpleQueue()
        for target in (self._read, self._write):
            threading.Thread(target=target, daemon=True).start()

    def send(self, message: WireMessage) -> None:
        """Send a message, without waiting; if the worker is dead, `receive` reports it."""
        self._outgoing.put(message)

    async def receive(self) -> Any:
        """The next message, or None if the worker is dead."""
        return await self._received.get()

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
        self._outgoing.put(None)

    def _read(self) -> None:
        message: Any = None
        with suppress(RuntimeError):  # the event loop is closed
            while True:
                try:
                    message = decode_from_worker(self._connection.recv_bytes())
                except (EOFError, OSError):
                    message = None
                self._loop.call_soon_threadsafe(self._received.put_nowait, message)
                if message is None:
                    return

    def _write(self) -> None:
        with suppress(OSError):
            while (message := self._outgoing.get()) is not None:
                self._connection.send_bytes(encode(message))


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
            starting = asyncio.ensure_future(asyncio.to_thread(WorkerProcess, asyncio.get_running_loop()))
            try:
                return await asyncio.shield(starting)
            except asyncio.CancelledError:
                starting.add_done_callback(
                    self._discard_started
                )  # the thread goes on, and nobody wants its worker
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
        """Wait until all workers have ended."""
        await asyncio.gather(*self._ending)


def _run_worker(connection: Connection) -> None:
    from experiments.web.worker.main import Worker  # the server never loads it

    Worker(connection).run()
