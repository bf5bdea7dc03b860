"""A WebSocket client with which simulated participants play trials."""

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager
from typing import Any, cast

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import WebSocketException
from websockets.typing import Origin

from experiments.study.rehearsal.player import STEPS, SimulatedPlayer

ANSWER_TIMEOUT = 2.0  # maximum time to wait for a new state before the next input is sent, in seconds
DELAYED = 15  # number of initial inputs that are delayed on a slow connection
OPENING_TIMEOUT = 600.0  # maximum time until a session is ready, in seconds
VIEW = {"type": "view", "width": 1280, "height": 720, "codec": "none"}
# The display report of a fast browser. It is sent after this number of inputs, which last 5 s.
DISPLAY_EVERY = 8
DISPLAY = {"type": "display", "draw": "browser", "renderer": "rehearsal", "width": 1280, "height": 720}
DISPLAY |= {"pixel_ratio": 1.0, "frames_per_s": 60.0, "frame_ms": 16.7, "frame_ms_95": 20.0, "dropped": 0}


class LostError(Exception):
    """Raised if the server has closed the connection or does not respond."""


class Link:
    """A connection to a trial, opened by :func:`connected`. `decisions` counts the inputs that were sent."""

    def __init__(self, socket: ClientConnection, player: SimulatedPlayer) -> None:
        self._socket, self._player = socket, player
        self._phase, self._saved, self._occupied, self._number = "", False, False, 0
        self._news = asyncio.Event()
        self._lost = False
        self.decisions = 0
        self.refused: list[str] = []

    async def occupied(self) -> None:
        """Wait until the server reports that the session is open in another page."""
        await self._wait(lambda: self._occupied, OPENING_TIMEOUT)

    def cut(self) -> None:
        self._socket.transport.abort()

    async def play(self, decisions: int, delay: float) -> bool:
        """Play until the trial is saved or a number of inputs has been sent. Return True if it was saved.

        The first inputs are delayed by `delay` seconds. Raises LostError if the connection is lost.
        """
        await self._wait(
            lambda: self._phase in ("ready", "paused", "over") or self._occupied, OPENING_TIMEOUT
        )
        if self._occupied:
            await self.say(type="takeover")
        while not self._saved:
            if self.decisions >= decisions:
                return False
            if self._phase in ("ready", "paused"):
                await self.say(type="run", until=self._player.step if self._phase == "ready" else 0)
                await self._wait(lambda: self._phase not in ("ready", "paused"), ANSWER_TIMEOUT)
            elif self._phase == "running" and self._player.state is not None:
                await self._decide(delay * (self.decisions < DELAYED))
            else:
                await self._news_come()
        return True

    async def _decide(self, delay: float) -> None:
        player, step = self._player, self._player.step
        if self.decisions % DISPLAY_EVERY == 0:
            await self.say(**DISPLAY)
        self._number += 1
        self.decisions += 1
        inputs = [{"number": self._number, "step": step, **player.act()}]
        await asyncio.sleep(delay)
        await self.say(type="inputs", inputs=inputs, until=step + STEPS)
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(ANSWER_TIMEOUT):
                while player.step < step + STEPS and self._phase == "running" and not self._lost:
                    await self._news_come()

    async def _wait(self, holds: Callable[[], bool], seconds: float) -> None:
        async with asyncio.timeout(seconds):
            while not holds():
                await self._news_come()

    async def _news_come(self) -> None:
        if self._lost:
            raise LostError("the connection is gone")
        self._news.clear()
        await self._news.wait()

    async def say(self, **message: Any) -> None:
        try:
            await self._socket.send(json.dumps(message))
        except WebSocketException as error:
            raise LostError(str(error)) from error

    async def receive(self) -> None:
        try:
            async for text in self._socket:
                await self._take(json.loads(text))
                self._news.set()
        except (OSError, WebSocketException, LostError):
            pass
        finally:
            self._lost = True
            self._news.set()

    async def _take(self, message: Mapping[str, Any]) -> None:
        match message["type"]:
            case "state":
                self._phase = message["phase"]
                self._number = max(self._number, message["input"])
            case "saved":
                self._saved = True
            case "occupied":
                self._occupied = True
            case "queue":
                raise LostError("the page has to wait for a slot")
            case "beat":
                await self.say(type="beat")
            case "error":
                self.refused.append(message["message"])
            case _:
                self._player.take(message)


@asynccontextmanager
async def connected(
    base: str, path: str, trial: str, tab: str, player: SimulatedPlayer
) -> AsyncIterator[Link]:
    """Connect to a trial as a web page does, and disconnect at the end of the block."""
    url, origin = f"ws{base.removeprefix('http')}{path}", cast("Origin", base)
    async with connect(url, origin=origin, max_size=None) as socket:
        link = Link(socket, player)
        receiving = asyncio.create_task(link.receive())
        try:
            await link.say(type="hello", tab=tab, trial=trial, view=VIEW)
            yield link
        finally:
            receiving.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await receiving
