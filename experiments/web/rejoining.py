"""How processes outlive their server: they wait in a folder for one that is started again.

A worker waits in the folder of its session, the process that forks workers in the folder of all visits.
"""

import os
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

SOCKET = "worker.sock"  # in the folder of a journal
PATIENCE = 60.0  # s that a process waits for a server
PERIOD = 0.2  # s between two looks whether there is still something to wait for


def wait_for_server(
    folder: Path, waiting: Callable[[], bool] = lambda: True, name: str = SOCKET
) -> socket.socket | None:
    """Wait for a server to ask in a folder; the socket to it, or None if none came.

    Args:
        folder: Of the session's journal, or of all visits.
        waiting: Whether there is still something to wait for.
        name: Of the socket.
    """
    with suppress(OSError), _short(folder, name) as path, socket.socket(socket.AF_UNIX) as listener:
        Path(path).unlink(missing_ok=True)  # of a process that was killed
        listener.bind(path)
        try:
            Path(path).chmod(0o600)  # nobody can connect before it listens
            listener.listen(1)
            listener.settimeout(PERIOD)
            return _accept(listener, waiting)
        finally:
            Path(path).unlink()
    return None


def ask(folder: Path, name: str = SOCKET) -> socket.socket | None:
    """The socket to the process that waits in a folder, or None if there is none."""
    link = socket.socket(socket.AF_UNIX)
    try:
        with _short(folder, name) as path:
            link.connect(path)
    except OSError:
        link.close()
        return None
    return link


def _accept(listener: socket.socket, waiting: Callable[[], bool]) -> socket.socket | None:
    until = time.monotonic() + PATIENCE
    while time.monotonic() < until and waiting():
        with suppress(TimeoutError):
            link, _ = listener.accept()
            link.setblocking(True)
            return link
    return None


def let_go_of_stderr() -> None:
    """Whoever waits for the end of what the server says need not wait for this process."""
    with Path(os.devnull).open("wb") as nothing:
        os.dup2(nothing.fileno(), 2)


@contextmanager
def _short(folder: Path, name: str) -> Iterator[str]:
    """The path of the socket; a name of some hundred bytes is too long for one, so it goes through a descriptor."""
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        yield f"/proc/self/fd/{handle}/{name}"
    finally:
        os.close(handle)
