"""The WebSocket connection to a browser. It validates messages and never waits for a slow browser."""

import asyncio
import time
from collections.abc import Awaitable, Callable
from contextlib import suppress
from typing import Any, NoReturn, Self

import msgspec
from starlette.websockets import WebSocket, WebSocketDisconnect

from experiments.web import protocol
from experiments.web.protocol import BEAT_PERIOD, Beat, Error, Hello, Inputs, Occupied, Saved, TakeOver
from experiments.web.server.played_session import PlayedSession
from experiments.web.state import OVER, State, WireMessage

HELLO_TIMEOUT = 10.0  # timeout for receiving the first message, in seconds
OCCUPIED_TIMEOUT = 60.0  # timeout for the reply to `occupied`, in seconds
CLOSE_TIMEOUT = 0.5  # how long to wait for a connection to close, in seconds
MAX_WAITING = 300  # maximum number of messages in the send queue
RATE, BURST = 200.0, 1200.0  # maximum number of messages and inputs: per second, and in a burst
MAX_ERRORS = 50  # number of rejected messages after which a connection is closed


class BrowserSocket:
    """An accepted WebSocket connection. A separate task sends the queued messages in order."""

    def __init__(self, socket: WebSocket) -> None:
        self.tab = ""
        self._socket = socket
        self._waiting: asyncio.Queue[WireMessage | tuple[int, str]] = asyncio.Queue()
        self._allowed, self._at = BURST, time.monotonic()
        self._errors = 0

    def send(self, message: WireMessage) -> None:
        """Queue a message. If the queue is full, disconnect the browser."""
        waiting = self._waiting.qsize()
        if waiting < MAX_WAITING:
            self._waiting.put_nowait(message)
        elif waiting == MAX_WAITING:
            self.close(protocol.SLOW, "too slow")

    def close(self, code: int, reason: str) -> None:
        self._waiting.put_nowait((code, reason))

    async def serve(self, session: PlayedSession) -> None:
        """Serve a participant's page until it disconnects."""
        await self._until_closed(session.detach, self._receive_all(session), self._beat(session))

    async def watch(self, session: PlayedSession) -> None:
        """Show a session to a spectator until their page disconnects or sends a message."""
        session.spectators.join(self)
        await self._until_closed(session.spectators.leave, self._socket.receive())

    async def _until_closed(
        self, leave: Callable[[Self], None], receiving: Awaitable[Any], *others: Awaitable[Any]
    ) -> None:
        """Send the queued messages until `receiving` or the connection ends. Then leave the session."""
        tasks = [asyncio.ensure_future(one) for one in (self._send_all(), receiving, *others)]
        try:
            await asyncio.wait(tasks[:2], return_when=asyncio.FIRST_COMPLETED)
            leave(self)
            self.close(protocol.REFUSED, "")
            await asyncio.wait(tasks[:1], timeout=CLOSE_TIMEOUT)  # waits until the last message is sent
        finally:
            leave(self)
            for task in tasks:
                task.cancel()
                # A socket that is already closed raises a RuntimeError.
                with suppress(asyncio.CancelledError, WebSocketDisconnect, OSError, RuntimeError):
                    await task

    async def _send_all(self) -> None:
        with suppress(WebSocketDisconnect, RuntimeError, OSError):  # raised if the browser has disconnected
            while isinstance(item := await self._waiting.get(), WireMessage):
                if isinstance(item, protocol.FrameMessage):
                    await self._socket.send_bytes(item.packed())
                else:
                    await self._socket.send_text(protocol.encode_to_browser(item).decode())
            await self._socket.close(*item)

    async def _beat(self, session: PlayedSession) -> None:
        while True:
            await asyncio.sleep(BEAT_PERIOD)
            if session.browser is self and self._waiting.empty():
                self.send(Beat())

    async def _receive_all(self, session: PlayedSession) -> None:
        try:
            hello = await asyncio.wait_for(self._hello(), HELLO_TIMEOUT)
        except TimeoutError:
            self._end(Error("idle", "no hello was received"))
        under_way = session.trial or await session.player.trial()
        if under_way is None or under_way.phase != hello.trial:
            self.send(State(OVER))
            self.send(Saved())
            return
        self.tab = hello.tab
        try:
            await asyncio.wait_for(self._wait_for_place(session), OCCUPIED_TIMEOUT)
        except TimeoutError:
            self._end(Error("idle", "no answer to occupied"))
        session.attach(self, hello.view)
        while True:
            message = await self._receive()
            if isinstance(message, Hello | TakeOver):
                self._refuse(Error("out of order", "the connection is open already"))
            elif (error := session.take(message)) is not None:
                self._refuse(error)

    async def _hello(self) -> Hello:
        while not isinstance(message := await self._receive(), Hello):
            self._refuse(Error("too early", "the first message must be hello"))
        return message

    async def _wait_for_place(self, session: PlayedSession) -> None:
        until = time.monotonic() + CLOSE_TIMEOUT
        while (before := session.browser) is not None and before.tab != self.tab:
            if time.monotonic() < until:
                await asyncio.sleep(0.05)
                continue
            self.send(Occupied())
            while not isinstance(message := await self._receive(), TakeOver):
                if not isinstance(message, Beat):
                    self._refuse(Error("too early", "the session is open in another page"))
            return

    async def _receive(self) -> WireMessage:
        """Return the next well-formed message. Raises WebSocketDisconnect if the browser has disconnected."""
        while True:
            event = await self._socket.receive()
            if event["type"] != "websocket.receive":
                raise WebSocketDisconnect(event.get("code", 1006))
            try:
                message: WireMessage = protocol.decode_from_browser(event.get("text") or "")
            except (msgspec.DecodeError, RecursionError) as error:
                self._count(1)
                self._refuse(Error("malformed", str(error) or "nested too deeply"))
            else:
                self._count(max(1, len(message.inputs)) if isinstance(message, Inputs) else 1)
                return message

    def _count(self, number: int) -> None:
        now = time.monotonic()
        self._allowed = min(BURST, self._allowed + (now - self._at) * RATE) - number
        self._at = now
        if self._allowed < 0.0:
            self._end(Error("too much", f"at most {RATE:.0f} messages and inputs a second"))

    def _refuse(self, error: Error) -> None:
        self._errors += 1
        if self._errors > MAX_ERRORS:
            self._end(Error("too much", f"more than {MAX_ERRORS} messages were refused"))
        self.send(error)

    def _end(self, error: Error) -> NoReturn:
        self.send(error)
        self.close(protocol.TOO_MUCH, error.code)
        raise WebSocketDisconnect(protocol.TOO_MUCH)
