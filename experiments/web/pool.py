"""Worker processes, forked when a session needs one, and the places that sessions share."""

import asyncio
import hashlib
import os
import signal
import socket
import subprocess
import sys
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from experiments.web.messages import (
    END,
    FORK,
    LENGTH,
    MAX_MESSAGE,
    Exit,
    Message,
    Started,
    decode_from_worker,
    packed,
)
from experiments.web.rejoining import ask

ROOT = Path(__file__).parents[2]
PACKAGES = ("experiments", "hud", "mjsim", "planner", "models")
ONE_HEAP = {"MALLOC_ARENA_MAX": "1"}  # one for each thread would keep what each once needed
KINDS = ("*.py", "*.toml", "*.xml")
PATIENCE = 5.0  # s that a process has to end by itself
STARTS = 3  # of the process that forks workers, after which none can be had


class WorkerProcess:
    """A worker process and the socket to it."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._reader, self._writer = reader, writer
        self.process = 0

    @classmethod
    async def at(cls, link: socket.socket) -> "WorkerProcess | None":
        """The worker at the other end of a socket, once it has said that it is there; None if it is not."""
        worker = cls(*await asyncio.open_connection(sock=link))
        try:
            started = await worker.receive()
        except asyncio.CancelledError:
            worker._writer.close()
            raise
        if not isinstance(started, Started):
            worker._writer.close()
            return None
        worker.process = started.process
        return worker

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
        self.send(Exit())
        try:
            await asyncio.wait_for(self._ended(), PATIENCE)
        except TimeoutError:
            with suppress(ProcessLookupError):
                os.kill(self.process, signal.SIGKILL)
        self._writer.close()

    async def _ended(self) -> None:
        with suppress(OSError):
            while await self._reader.read(MAX_MESSAGE):
                pass


class Pool:
    """Gives workers.

    Args:
        house: Name of the house that is played in; others are loaded when they are needed.
        folder: Of the visits.
    """

    def __init__(self, house: str, folder: Path) -> None:
        self._house = house
        self._rejoin = folder / f"forkserver-{_loaded(house)}.sock"
        self._control: socket.socket | None = None
        self._forkserver: subprocess.Popen[bytes] | None = None
        self._closing: set[asyncio.Task[None]] = set()

    def warm_up(self) -> None:
        """Start the process that forks workers, where it does not run; one that has lost its server goes on."""
        if self._control is not None and (self._forkserver is None or self._forkserver.poll() is None):
            return
        self.hang_up()
        if (control := ask(self._rejoin.parent, self._rejoin.name)) is not None:
            self._control, self._forkserver = control, None
            return
        self._control, theirs = socket.socketpair()
        with theirs:
            self._forkserver = subprocess.Popen(
                (
                    sys.executable,
                    "-P",
                    "-m",
                    "experiments.web.forkserver",
                    str(theirs.fileno()),
                    self._house,
                    str(self._rejoin),
                ),
                pass_fds=[theirs.fileno()],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                start_new_session=True,  # Ctrl-C in a terminal is for the server alone
                env={
                    **os.environ,
                    **ONE_HEAP,
                    "PYTHONPATH": os.pathsep.join(path for path in sys.path if path),
                },
            )

    async def take(self, journal: Path) -> WorkerProcess:
        """The worker that has a session open since before this server was started; if there is none, a new one.

        Args:
            journal: Folder of the session's journal.

        Raises:
            OSError: No worker can be started.
        """
        if (link := ask(journal)) is not None and (worker := await WorkerProcess.at(link)) is not None:
            return worker
        for _ in range(STARTS):
            if (worker := await self._fork()) is not None:
                return worker
        raise OSError("no worker can be started")

    def discard(self, worker: WorkerProcess) -> None:
        """End a worker, without waiting for it."""
        task = asyncio.create_task(worker.close())
        self._closing.add(task)
        task.add_done_callback(self._closing.discard)

    async def close(self) -> None:
        """End all workers, and wait for that."""
        self.hang_up()
        if self._closing:
            await asyncio.wait(list(self._closing))
        if self._forkserver is not None:
            await asyncio.to_thread(_end, self._forkserver)

    async def _fork(self) -> WorkerProcess | None:
        """A new worker; None if the process that forks them died meanwhile."""
        self.warm_up()
        ours, theirs = socket.socketpair()
        with theirs, suppress(OSError):
            if self._control is not None:
                socket.send_fds(self._control, [FORK], [theirs.fileno()])
        if (worker := await WorkerProcess.at(ours)) is None:
            self.hang_up()
        return worker

    def hang_up(self) -> None:
        """End the process that forks workers."""
        if self._control is not None:
            with suppress(OSError):
                self._control.send(END)
            self._control.close()
            self._control = None


def _loaded(house: str) -> str:
    """16 hex digits that change with the program and the house: what has loaded others is of no use."""
    folders = [ROOT / name for name in PACKAGES] + ([Path(house).parent] if Path(house).is_file() else [])
    digest = hashlib.sha256(f"{sys.executable} {house}".encode())
    for path in sorted(path for folder in folders for kind in KINDS for path in folder.rglob(kind)):
        digest.update(f"{path} {path.stat().st_mtime_ns}".encode())
    return digest.hexdigest()[:16]


def _end(process: subprocess.Popen[bytes]) -> None:
    try:
        process.wait(PATIENCE)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


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
