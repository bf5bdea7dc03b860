"""The WebSocket of a browser: checks what comes in, and sends without ever waiting for a slow browser."""

import asyncio
import time
from contextlib import suppress

import msgspec
from starlette.websockets import WebSocket, WebSocketDisconnect

from experiments.web import messages, protocol
from experiments.web.messages import Message
from experiments.web.played_session import PlayedSession

HELLO_PATIENCE = 10.0  # s for the first message
OLD_PATIENCE = 0.5  # s that the connection before has to end, as when a page is loaded again
MAX_WAITING = 300  # messages that wait to be sent
MAX_STATES_WAITING = 8  # from then on, no further states
RATE, BURST = 200.0, 400.0  # messages a second, and at once
MAX_ERRORS = 50  # refused messages of one connection


class BrowserSocket:
    """A connection of a browser. Messages are sent in order by a task of its own.

    Args:
        socket: Accepted.

    Attributes:
        tab: Name of the page.
    """

    def __init__(self, socket: WebSocket) -> None:
        self.tab = ""
        self._socket = socket
        self._waiting: asyncio.Queue[Message | tuple[int, str]] = asyncio.Queue()
        self._allowed, self._at = BURST, time.monotonic()
        self._errors = 0

    def send(self, message: Message) -> None:
        """Send a message, without waiting; a browser that does not keep up is disconnected."""
        waiting = self._waiting.qsize()
        if isinstance(message, messages.State) and waiting > MAX_STATES_WAITING:
            return
        if waiting < MAX_WAITING:
            self._waiting.put_nowait(message)
        elif waiting == MAX_WAITING:
            self.close(protocol.SLOW, "too slow")

    def close(self, code: int, reason: str) -> None:
        """Close the connection once all is sent."""
        self._waiting.put_nowait((code, reason))

    async def serve(self, session: PlayedSession, phase: str) -> None:
        """Serve until the browser is gone.

        Args:
            session: The session.
            phase: Part of the visit that is under way.
        """
        sending = asyncio.create_task(self._send_all())
        receiving = asyncio.create_task(self._receive_all(session, phase))
        try:
            await asyncio.wait((sending, receiving), return_when=asyncio.FIRST_COMPLETED)
            session.detach(self)
            self.close(protocol.REFUSED, "")
            await asyncio.wait([sending], timeout=OLD_PATIENCE)  # what was said last is still to be sent
        finally:
            session.detach(self)
            for task in (sending, receiving):
                task.cancel()
                with suppress(asyncio.CancelledError, WebSocketDisconnect, OSError):
                    await task

    async def _send_all(self) -> None:
        with suppress(WebSocketDisconnect, RuntimeError, OSError):  # the browser is gone
            while isinstance(item := await self._waiting.get(), Message):
                if isinstance(item, messages.Frame):
                    await self._socket.send_bytes(protocol.packed_frame(item))
                else:
                    await self._socket.send_text(protocol.encode_to_browser(item).decode())
            await self._socket.close(*item)

    async def _receive_all(self, session: PlayedSession, phase: str) -> None:
        try:
            hello = await asyncio.wait_for(self._hello(), HELLO_PATIENCE)
        except TimeoutError:
            self._end(protocol.Error("idle", "no hello came"))
            return
        self.tab = hello.tab
        if hello.phase != phase:
            self.send(messages.Over("over", None))
            return
        await self._wait_for_place(session)
        session.attach(self, hello.view)
        while True:
            message = await self._receive()
            if isinstance(message, protocol.Hello | protocol.TakeOver):
                self._refuse(protocol.Error("out of order", "the connection has begun already"))
            elif (error := session.take(message)) is not None:
                self._refuse(error)

    async def _hello(self) -> protocol.Hello:
        while not isinstance(message := await self._receive(), protocol.Hello):
            self._refuse(protocol.Error("too early", "the first message must be hello"))
        return message

    async def _wait_for_place(self, session: PlayedSession) -> None:
        """Wait until no other page has the session, or this one is to take it over."""
        until = time.monotonic() + OLD_PATIENCE
        while isinstance(before := session.browser, BrowserSocket) and before.tab != self.tab:
            if time.monotonic() < until:
                await asyncio.sleep(0.05)
                continue
            self.send(protocol.Occupied())
            while not isinstance(await self._receive(), protocol.TakeOver):
                self._refuse(protocol.Error("too early", "the session is open elsewhere"))
            return

    async def _receive(self) -> Message:
        """The next message that is one.

        Raises:
            WebSocketDisconnect: The browser is gone, or was disconnected.
        """
        while True:
            event = await self._socket.receive()
            if event["type"] != "websocket.receive":
                raise WebSocketDisconnect(event.get("code", 1006))
            self._check_rate()
            try:
                message: Message = protocol.decode_from_browser(event.get("text") or "")
            except (msgspec.DecodeError, RecursionError) as error:
                self._refuse(protocol.Error("malformed", str(error) or "nested too deeply"))
            else:
                return message

    def _check_rate(self) -> None:
        now = time.monotonic()
        self._allowed = min(BURST, self._allowed + (now - self._at) * RATE) - 1.0
        self._at = now
        if self._allowed < 0.0:
            self._end(protocol.Error("too much", f"at most {RATE:.0f} messages a second"))

    def _refuse(self, error: protocol.Error) -> None:
        self._errors += 1
        if self._errors > MAX_ERRORS:
            self._end(protocol.Error("too much", f"more than {MAX_ERRORS} messages were refused"))
        self.send(error)

    def _end(self, error: protocol.Error) -> None:
        self.send(error)
        self.close(protocol.TOO_MUCH, error.code)
        raise WebSocketDisconnect(protocol.TOO_MUCH)
