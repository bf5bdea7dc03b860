"""HTTP connections with timeouts and a limit on their number."""

import asyncio
from collections import Counter
from typing import ClassVar

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

from experiments.web.server.guards import address_of, machine_of

REQUEST_TIMEOUT = 10.0  # timeout for receiving a request, in seconds
MAX_OPEN = 2000  # maximum number of connections, WebSockets excluded


class QuickConnection(H11Protocol):
    """A uvicorn connection with timeouts. Beyond the limit, the address with the most connections loses one."""

    _open: ClassVar[dict["QuickConnection", str]] = {}  # clients by connection, oldest first
    _timer: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        self._open[self] = machine_of(address_of(self.client[0] if self.client else ""))
        self._watch()
        if len(self._open) > MAX_OPEN:
            [(busiest, _)] = Counter(self._open.values()).most_common(1)
            oldest = next(one for one, machine in self._open.items() if machine == busiest)
            oldest._forget()
            oldest.transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        super().connection_lost(exc)
        self._forget()

    def data_received(self, data: bytes) -> None:
        super().data_received(data)
        if self in self._open:
            self._watch()

    def handle_websocket_upgrade(self, event: h11.Request) -> None:
        """Exempt the connection, since WebSockets have their own limits."""
        self._forget()
        super().handle_websocket_upgrade(event)

    def _watch(self) -> None:
        """Start the timeout of a request, or stop it if the request is complete."""
        if self.conn.their_state not in (h11.IDLE, h11.SEND_BODY):
            self._stop()
        elif self._timer is None:
            self._timer = self.loop.call_later(REQUEST_TIMEOUT, self.transport.abort)

    def _stop(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _forget(self) -> None:
        self._open.pop(self, None)
        self._stop()
