"""A slow link between a browser and a server: a proxy that delays, limits and counts what passes."""

import asyncio
import socket
import threading
import time
from contextlib import suppress
from types import TracebackType

CHUNK = 4096  # bytes that pass at a time


def free_port() -> int:
    """A port of this machine at which nothing listens."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class SlowLink:
    """Forwards connections to a port of this machine. Use as a context manager.

    Args:
        bits: Bits a second, each way, for all connections together.
        delay: Of every byte, each way, and of every new connection, s.

    Attributes:
        port: Where it listens.
        target: The port that it leads to, which was free.
        bytes: How many have passed to the browser.
    """

    def __init__(self, bits: float, delay: float) -> None:
        self._bits, self._delay = bits, delay
        self._loop = asyncio.new_event_loop()
        self._free_at = [0.0, 0.0]  # when the link has room again, to the server and from it
        self.target, self.port, self.bytes = free_port(), 0, 0

    def __enter__(self) -> "SlowLink":
        listening = threading.Event()
        self._thread = threading.Thread(target=self._run, args=(listening,), daemon=True)
        self._thread.start()
        listening.wait()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()

    def _run(self, listening: threading.Event) -> None:
        asyncio.set_event_loop(self._loop)
        server = self._loop.run_until_complete(asyncio.start_server(self._connect, "127.0.0.1", 0))
        self.port = server.sockets[0].getsockname()[1]
        listening.set()
        self._loop.run_forever()

    async def _connect(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await asyncio.sleep(2.0 * self._delay)  # the handshake
        there, back = await asyncio.open_connection("127.0.0.1", self.target)
        await asyncio.gather(self._forward(reader, back, 0), self._forward(there, writer, 1))

    async def _forward(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, way: int) -> None:
        passing: asyncio.Queue[tuple[float, bytes]] = asyncio.Queue()
        arriving = asyncio.create_task(self._arrive(passing, writer))
        with suppress(OSError):
            while content := await reader.read(CHUNK):
                now = time.monotonic()
                self._free_at[way] = max(now, self._free_at[way]) + 8.0 * len(content) / self._bits
                self.bytes += len(content) * way
                passing.put_nowait((self._free_at[way] + self._delay, content))
                await asyncio.sleep(self._free_at[way] - now)
        passing.put_nowait((time.monotonic() + self._delay, b""))
        await arriving

    async def _arrive(
        self, passing: asyncio.Queue[tuple[float, bytes]], writer: asyncio.StreamWriter
    ) -> None:
        with suppress(OSError):
            while True:
                at, content = await passing.get()
                await asyncio.sleep(max(0.0, at - time.monotonic()))
                if not content:
                    break
                writer.write(content)
                await writer.drain()
        writer.close()
