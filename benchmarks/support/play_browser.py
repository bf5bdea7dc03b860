"""A simulated browser for `mjsim play`, whose network connection may be slow and lossy."""

import asyncio
import json
import secrets
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, cast
from urllib.parse import urlsplit

import numpy as np
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed

from benchmarks.support.play_server import PATIENCE
from benchmarks.support.simulated_link import CountingConnection, Link
from experiments.web.protocol import BEAT_PERIOD, FRAME_HEAD, MAX_INPUTS, MAX_STEPS_AHEAD

STEP = 0.04  # duration of a control step in seconds
# An incomplete text frame: it announces 126 bytes, masked with zeros, but ends early.
HALF_A_MESSAGE = b"\x81\xfe\x00\x7e" + bytes(4) + b'{"type": "inputs", "inputs": [{"num'


@dataclass(frozen=True)
class SeenFrame:
    """A frame or snapshot that was received from the server.

    Attributes:
        at: Time of arrival according to `time.perf_counter`.
        input: Number of the last input that it reflects.
        width: Width of a frame in pixels, or 0 for a snapshot.
    """

    at: float
    input: int
    width: int


class SimulatedBrowser:
    """A client that plays through a socket like the web page, and resends unacknowledged inputs.

    Args:
        address: Address of the visit.
        codec: `jpeg`, `h264`, or `none` for a client that draws. A drawing client stamps its inputs with
            control steps and promises that no further inputs will follow for a step.
        link: Properties of the network.
        size: Size of the view in pixels.
        seed: Seed of the network's random delays.

    Attributes:
        next: Number of the next input.
        acknowledged: Number of the last acknowledged input.
        frames: All received frames and snapshots.
        last: Latest message of each type.
        sent_at: Sending time of each input, by number.
        trips: Times from sending an input to its acknowledgement, s.
    """

    def __init__(
        self,
        address: str,
        *,
        codec: str = "none",
        link: Link | None = None,
        size: tuple[int, int] = (640, 480),
        seed: int = 0,
    ) -> None:
        self.address = address
        self._tab = secrets.token_hex(8)
        self._view = {"type": "view", "width": size[0], "height": size[1], "codec": codec}
        self.draws = codec == "none"
        self._step: int | None = (
            None  # next control step of a drawing client, or None while the clock is paused
        )
        self._newest = 0  # control step of the latest snapshot
        self._made: list[dict[str, Any]] = []  # inputs that are sent with the next control step
        self._link, self._rng = link or Link(), np.random.default_rng(seed)
        self._changed = asyncio.Condition()
        self._tasks: list[asyncio.Task[None]] = []
        self._out: asyncio.Queue[tuple[float, str]] = asyncio.Queue()
        self._waiting: list[dict[str, Any]] = []
        self._socket: CountingConnection | None = None
        self.next, self.acknowledged = 1, 0
        self.trips: list[float] = []
        self.frames: list[SeenFrame] = []
        self.last: dict[str, dict[str, Any]] = {}
        self.sent_at: dict[int, float] = {}

    async def open(self, trial: str) -> None:
        """Connect to the server and send the hello message."""
        parts = urlsplit(self.address)
        self.last.clear()
        self._out = asyncio.Queue()
        connection = await connect(
            f"ws://{parts.netloc}{parts.path}",
            origin=f"http://{parts.netloc}",  # type: ignore[arg-type]
            max_size=None,
            compression="deflate",
            open_timeout=PATIENCE,
            create_connection=CountingConnection,
        )
        self._socket = cast(CountingConnection, connection)
        self.say(type="hello", tab=self._tab, trial=trial, view=self._view)
        doing = [self._send_all(), self._receive_all(), self._beat()]
        doing += [self._take_steps()] if self.draws else []
        self._tasks = [asyncio.create_task(task) for task in doing]

    def lose(self, *, amid_a_message: bool = False) -> None:
        """Drop the connection without a close message, optionally in the middle of another message."""
        if self._socket is not None:
            if amid_a_message:
                self._socket.transport.write(HALF_A_MESSAGE)
            self._socket.transport.abort()

    async def cut(self, *, amid_a_message: bool = False) -> None:
        """Drop the connection and stop its tasks."""
        self.lose(amid_a_message=amid_a_message)
        await self._end()

    async def close(self) -> None:
        if self._socket is not None:
            await self._socket.close()
        await self._end()

    def reload(self) -> None:
        """Discard the state that a page loses when it is reloaded."""
        self._waiting, self._tab = [], secrets.token_hex(8)

    def forget(self) -> None:
        """Discard the frames and times that have been recorded."""
        self.frames.clear()
        self.sent_at.clear()
        self.trips.clear()

    @property
    def arrived(self) -> int:
        """The number of bytes that have been received on this connection."""
        return 0 if self._socket is None else self._socket.received

    @property
    def pending(self) -> int:
        return len(self._waiting)

    def say(self, **message: Any) -> None:
        due = time.perf_counter() + self._link.delay(self._rng)
        self._out.put_nowait((due, json.dumps(message)))

    def press(self, **values: Any) -> int:
        """Send an input, or queue it for the next control step. Return its number."""
        number, self.next = self.next, self.next + 1
        new = {"number": number, **values}
        self._waiting.append(new)
        if self._step is not None:
            self._made.append({**new, "step": self._step})
        else:
            self._send_inputs([new])
        return number

    async def until(self, holds: Callable[[], bool], seconds: float = PATIENCE) -> None:
        """Wait until a condition holds.

        Raises:
            TimeoutError: The condition is still false after `seconds`.
            ConnectionError: The server has closed the connection.
        """

        async def wait() -> None:
            async with self._changed:
                await self._changed.wait_for(lambda: holds() or "closed" in self.last)

        try:
            await asyncio.wait_for(wait(), seconds)
        except TimeoutError as error:
            raise TimeoutError(
                f"the server did not answer within {seconds:.0f} s; it said {sorted(self.last)}"
            ) from error
        if not holds():
            raise ConnectionError(f"the server closed the connection; it said {sorted(self.last)}")

    @property
    def phase(self) -> str:
        return str(self.last.get("state", {}).get("phase", ""))

    async def run(self) -> int:
        """Start the clock when the session is open, and resend unacknowledged inputs.

        Returns:
            Number of the last input that the session has received.
        """
        await self.until(lambda: self.phase in ("ready", "paused", "running"))
        number = int(self.last["state"]["input"])
        self._say_run()
        await self.until(lambda: self.phase == "running")
        self.next = max([number, *(new["number"] for new in self._waiting)]) + 1
        self._repeat()
        return number

    async def taken(self) -> None:
        await self.until(lambda: self.acknowledged >= self.next - 1)

    async def leave(self) -> None:
        self.last.pop("saved", None)
        self.say(type="leave")
        await self.until(lambda: "saved" in self.last)
        await self.close()

    def _say_run(self) -> None:
        self.say(type="run", **({"until": 0} if self.draws else {}))

    def _repeat(self) -> None:
        for first in range(0, len(self._waiting), MAX_INPUTS):
            self.say(type="inputs", inputs=self._waiting[first : first + MAX_INPUTS])

    def _send_inputs(self, inputs: list[dict[str, Any]], **promise: int) -> None:
        now = time.perf_counter()
        self.sent_at |= {new["number"]: now for new in inputs}
        self.say(type="inputs", inputs=inputs, **promise)

    async def _take_steps(self) -> None:
        """Advance the control steps while the clock runs, and send the inputs of each step."""
        while True:
            await asyncio.sleep(STEP)
            due = time.perf_counter()
            while self._step is not None:
                if self._step >= self._newest + MAX_STEPS_AHEAD:  # the server rejects steps beyond this limit
                    await asyncio.sleep(STEP)
                    due = time.perf_counter()
                    continue
                self._step += 1
                made, self._made = self._made, []
                self._send_inputs(made, until=self._step)
                due += STEP
                await asyncio.sleep(max(0.0, due - time.perf_counter()))
            self._made.clear()  # unacknowledged inputs are sent again when the clock restarts

    async def _beat(self) -> None:
        while True:
            self.say(type="beat")
            await asyncio.sleep(BEAT_PERIOD)

    async def _send_all(self) -> None:
        with suppress(ConnectionClosed):
            while self._socket is not None:
                due, text = await self._out.get()
                await asyncio.sleep(max(0.0, due - time.perf_counter()))
                await self._socket.send(text)

    async def _receive_all(self) -> None:
        arriving: asyncio.Queue[tuple[float, str | bytes]] = asyncio.Queue()
        self._tasks.append(asyncio.create_task(self._take_all(arriving)))
        with suppress(ConnectionClosed):
            while self._socket is not None:
                message = await self._socket.recv()
                arriving.put_nowait((time.perf_counter() + self._link.delay(self._rng), message))
        self.last["closed"] = {}
        await self._notify()

    async def _take_all(self, arriving: asyncio.Queue[tuple[float, str | bytes]]) -> None:
        """Handle messages when their simulated delay is over, in the order of their arrival."""
        while True:
            due, message = await arriving.get()
            await asyncio.sleep(max(0.0, due - time.perf_counter()))
            self._take(message)
            await self._notify()

    async def _notify(self) -> None:
        async with self._changed:
            self._changed.notify_all()

    def _take(self, message: str | bytes) -> None:
        if isinstance(message, bytes):
            _, _, _, _, width, _, number, _, shown, _ = FRAME_HEAD.unpack_from(message)
            self.frames.append(SeenFrame(time.perf_counter(), shown, width))
            self.say(type="seen", frame=number)
            return
        content = json.loads(message)
        self.last[content["type"]] = content
        if content["type"] == "snapshot":
            self.frames.append(SeenFrame(time.perf_counter(), content["input"], 0))
            self._newest = content["step"]
            self._step = self._newest if self._step is None else self._step
        if content["type"] == "state" and content["phase"] != "running":
            self._step = None
            if content["reason"] == "silent":
                self._say_run()
                self._repeat()
        if content["type"] == "taken":
            now, before = time.perf_counter(), self.acknowledged
            self.acknowledged = max(before, content["input"])
            acknowledged = range(before + 1, self.acknowledged + 1)
            self.trips += [now - self.sent_at[number] for number in acknowledged if number in self.sent_at]
            self._waiting = [new for new in self._waiting if new["number"] > content["input"]]

    async def _end(self) -> None:
        for task in self._tasks:
            task.cancel()
            with suppress(asyncio.CancelledError):
                await task
        self._socket, self._step = None, None
        self._made.clear()


async def begin_task(browser: SimulatedBrowser) -> None:
    await browser.open("training")
    await browser.until(lambda: browser.phase == "ready")
    await browser.leave()
    await browser.open("task")
    await browser.run()
