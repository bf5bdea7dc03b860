"""The worker's end of the socket to the server."""

import socket
import threading
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

from experiments.web import messages
from experiments.web.messages import Message, packed


class Connection:
    """The socket to the server; several threads send, one receives."""

    def __init__(self, link: socket.socket) -> None:
        self._link = link
        self._lock = threading.Lock()

    def send(self, message: Message) -> None:
        """Send a message; nothing happens if the server is gone, which the receiving thread notices."""
        with self._lock, suppress(OSError):
            self._link.sendall(packed(message))

    def replace(self, link: socket.socket) -> None:
        """Go on with another socket: the server was started again."""
        with self._lock:
            self._link.close()
            self._link = link

    def receive(self) -> Iterator[Any]:
        """Messages until the server closes the connection."""
        while (head := self._read(messages.LENGTH.size)) is not None:
            content = self._read(messages.LENGTH.unpack(head)[0])
            if content is None:
                return
            yield messages.decode_to_worker(content)

    def _read(self, count: int) -> bytes | None:
        parts = bytearray()
        while len(parts) < count:
            with suppress(OSError):
                part = self._link.recv(count - len(parts))
                if part:
                    parts += part
                    continue
            return None
        return bytes(parts)
