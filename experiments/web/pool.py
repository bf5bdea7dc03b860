"""Worker processes, one of them always warm, and the places that sessions share."""

import asyncio
import os
import socket
import sys
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from experiments.web.messages import LENGTH, MAX_MESSAGE, Message, decode_from_worker, packed

PATIENCE = 5.0  # s that a worker has to end by itself


class WorkerProcess:
    """A worker process and the socket to it. It ends when the socket is closed, also by the death of this process."""

    def __init__(
        self,
        process: asyncio.subprocess.Process,
        reader: asyncio.StreamReader,
        writer: asyncio.StreamWriter,
    ) -> None:
        self._process, self._reader, self._writer = process, reader, writer

    @classmethod
    async def start(cls) -> "WorkerProcess":
        """Start a worker; it loads the usual house while nobody needs it yet."""
        ours, theirs = socket.socketpair()
        with theirs:
            process = await asyncio.create_subprocess_exec(
                *(sys.executable, "-P", "-m", "experiments.web.worker", str(theirs.fileno())),
                pass_fds=[theirs.fileno()],
                stdin=asyncio.subprocess.DEVNULL,
                start_new_session=True,  # Ctrl-C in a terminal is for the server alone
                env={**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)},
            )
        reader, writer = await asyncio.open_connection(sock=ours)
        return cls(process, reader, writer)

    @property
    def pid(self) -> int:
        """Process number."""
        return self._process.pid

    @property
    def alive(self) -> bool:
        """Whether the process has not ended."""
        return self._process.returncode is None

    def send(self, message: Message) -> None:
        """Send a message; nothing happens if the worker is dead, which `receive` notices."""
        if not self._writer.is_closing():
            self._writer.write(packed(message))

    async def receive(self) -> Any:
        """The next message, or None if the worker is dead."""
        try:
            (length,) = LENGTH.unpack(await self._reader.readexactly(LENGTH.size))
            if length > MAX_MESSAGE:
                return None
            return decode_from_worker(await self._reader.readexactly(length))
        except (OSError, asyncio.IncompleteReadError):
            return None

    async def close(self) -> None:
        """End the process."""
        self._writer.close()
        try:
            await asyncio.wait_for(self._process.wait(), PATIENCE)
        except TimeoutError:
            with suppress(ProcessLookupError):
                self._process.kill()
            await self._process.wait()


class Pool:
    """Keeps a spare worker warm for the next session, or for one whose worker dies."""

    def __init__(self) -> None:
        self._spare: asyncio.Task[WorkerProcess] | None = None
        self._workers: set[WorkerProcess] = set()
        self._closing: set[asyncio.Task[None]] = set()
        self._closed = False

    def warm_up(self) -> None:
        """See that there is a spare worker."""
        if self._spare is None and not self._closed:
            self._spare = asyncio.create_task(self._start())

    async def take(self) -> WorkerProcess:
        """The spare worker; the next one is started."""
        while True:
            self.warm_up()
            spare, self._spare = self._spare, None
            if spare is None:
                raise asyncio.CancelledError
            try:
                worker = await asyncio.shield(spare)
            except asyncio.CancelledError:
                spare.add_done_callback(lambda started: self.discard(started.result()))
                raise
            self.warm_up()
            if worker.alive:
                return worker
            self.discard(worker)

    def discard(self, worker: WorkerProcess) -> None:
        """End a worker, without waiting for it."""
        self._workers.discard(worker)
        task = asyncio.create_task(worker.close())
        self._closing.add(task)
        task.add_done_callback(self._closing.discard)

    async def close(self) -> None:
        """End all workers, and wait for that."""
        self._closed = True
        if self._spare is not None:
            await asyncio.wait([self._spare])
        for worker in list(self._workers):
            self.discard(worker)
        if self._closing:
            await asyncio.wait(list(self._closing))

    async def _start(self) -> WorkerProcess:
        worker = await WorkerProcess.start()
        self._workers.add(worker)
        return worker


class Places:
    """So many sessions at a time; who comes later waits in a queue.

    Args:
        count: Of sessions.
    """

    def __init__(self, count: int) -> None:
        self._free = count
        self._waiting: deque[tuple[asyncio.Future[None], Callable[[int], None]]] = deque()

    @property
    def waiting(self) -> int:
        """How many wait."""
        return len(self._waiting)

    async def take(self, on_position: Callable[[int], None]) -> None:
        """Wait for a place.

        Args:
            on_position: Is told the position in the queue, 1 for the next one, whenever it changes.
        """
        if self._free and not self._waiting:
            self._free -= 1
            return
        turn: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        entry = turn, on_position
        self._waiting.append(entry)
        on_position(len(self._waiting))
        try:
            await turn
        except asyncio.CancelledError:
            if entry in self._waiting:
                self._waiting.remove(entry)
                self._tell()
            elif not turn.cancelled():
                self.give_back()
            raise

    def give_back(self) -> None:
        """Leave a place to who waits longest."""
        while self._waiting:
            turn, _ = self._waiting.popleft()
            if not turn.done():
                turn.set_result(None)
                self._tell()
                return
        self._free += 1

    def _tell(self) -> None:
        for i, (_, on_position) in enumerate(self._waiting):
            on_position(i + 1)
