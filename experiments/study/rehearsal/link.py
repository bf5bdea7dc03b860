"""The WebSocket of a simulated participant: plays a trial, over a connection that may be bad."""

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager
from typing import Any, cast

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import WebSocketException
from websockets.typing import Origin

from experiments.study.rehearsal.player import STEPS, Player

ANSWER_TIMEOUT = 2.0  # s without a new state after which it decides again
DELAYED = 15  # messages that are delayed
OPENING_TIMEOUT = 600.0  # s that others may keep the place
VIEW = {"type": "view", "width": 1280, "height": 720, "codec": "none"}


class LostError(Exception):
    """The server ended the connection, or does not answer."""


class Link:
    """One connection to a trial; :func:`connected` makes it.

    Args:
        socket: The connection.
        player: Decides.

    Attributes:
        decisions: How many were sent.
        refused: Messages `error` of the server.
    """

    def __init__(self, socket: ClientConnection, player: Player) -> None:
        self._socket, self._player = socket, player
        self._phase, self._saved, self._occupied, self._number = "", False, False, 0
        self._news = asyncio.Event()
        self._lost = False
        self.decisions = 0
        self.refused: list[str] = []

    async def occupied(self) -> None:
        """Wait until the server says that another page has the session."""
        await self._wait(lambda: self._occupied, OPENING_TIMEOUT)

    def cut(self) -> None:
        self._socket.transport.abort()

    async def play(self, decisions: int, delay: float) -> bool:
        """Play until the trial is saved, which gives True, or so many decisions were sent, which gives False.

        `delay` is how long the first messages take on their way, s.

        Raises:
            LostError: The connection is gone.
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
        """Send what to do for some control steps, and wait for the state after them."""
        player, step = self._player, self._player.step
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
        """Send a message; a LostError if the connection is gone."""
        try:
            await self._socket.send(json.dumps(message))
        except WebSocketException as error:
            raise LostError(str(error)) from error

    async def receive(self) -> None:
        """Take what the server sends until the connection is gone."""
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
async def connected(base: str, path: str, trial: str, tab: str, player: Player) -> AsyncIterator[Link]:
    """Connect a page to a trial; both are closed at the end.

    Args:
        base: URL of the server.
        path: Of the person's pages.
        trial: `training` or `task`.
        tab: Name of the page.
        player: Decides.
    """
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
