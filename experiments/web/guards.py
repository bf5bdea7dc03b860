"""What is checked of every request before the pages see it, and the headers of every answer."""

import ipaddress
import socket
import time
from collections.abc import Mapping
from dataclasses import dataclass
from urllib.parse import urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

MAX_BODY = 4096  # bytes of a form
HEADERS = {
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), microphone=(), geolocation=()",
}


@dataclass(frozen=True)
class Addresses:
    """Under which addresses the server is reached.

    Attributes:
        port: Its port.
        public: URL under which a proxy makes it public, or None.
    """

    port: int
    public: str | None = None

    def origin(self, host: str) -> str | None:
        """The origin of pages that are served under a `Host`; None if the server is not reached under it.

        A name that is not the server's own is refused: it would be another site's, rebound to this address.
        """
        if self.public is not None:
            public = urlsplit(self.public)
            if host == public.netloc:
                return f"{public.scheme}://{public.netloc}"
        try:
            parts = urlsplit(f"//{host}")
            name, port = parts.hostname or "", parts.port or 80
        except ValueError:
            return None
        if parts.netloc != host or "@" in host or port != self.port or not _is_own(name):
            return None
        return f"http://{host}"


class Guards:
    """ASGI middleware: checks `Host` and `Origin`, limits bodies, adds headers.

    Args:
        app: What is guarded.
        addresses: Under which it is reached.
    """

    def __init__(self, app: ASGIApp, addresses: Addresses) -> None:
        self._app, self._addresses = app, addresses

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle a request or a WebSocket."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        origin = self._addresses.origin(headers.get("host", ""))
        refusal = _refusal(scope, headers, origin)
        if scope["type"] == "websocket":
            if refusal is not None:
                await receive()
                await send({"type": "websocket.close", "code": 1008})
                return
            await self._app(scope, receive, send)
            return

        async def send_guarded(message: Message) -> None:
            if message["type"] == "http.response.start":
                _add_headers(MutableHeaders(scope=message), origin or "")
            await send(message)

        if refusal is not None:
            status, text = refusal
            await PlainTextResponse(f"{text}\n", status)(scope, receive, send_guarded)
        else:
            await self._app(scope, receive, send_guarded)


class Rate:
    """Limits how often something is done from one address.

    Args:
        count: So often.
        period: Within so many seconds.
    """

    def __init__(self, count: int, period: float) -> None:
        self._count, self._period = count, period
        self._times: dict[str, list[float]] = {}

    def allows(self, address: str) -> bool:
        """Whether once more is allowed; that counts."""
        now = time.monotonic()
        self._times = {a: kept for a, times in self._times.items() if (kept := self._recent(times, now))}
        times = self._times.setdefault(address, [])
        if len(times) >= self._count:
            return False
        times.append(now)
        return True

    def _recent(self, times: list[float], now: float) -> list[float]:
        return [at for at in times if now - at < self._period]


def _refusal(scope: Scope, headers: Mapping[str, str], origin: str | None) -> tuple[int, str] | None:
    """Status and text where a request is refused."""
    if origin is None:
        return 421, "This server is not reached under that name."
    changes = scope["type"] == "websocket" or scope["method"] not in ("GET", "HEAD")
    if changes and headers.get("origin") != origin:
        return 403, "This request does not come from a page of this server."
    length = headers.get("content-length", "0")
    if "transfer-encoding" in headers or not length.isdecimal() or int(length) > MAX_BODY:
        return 413, f"At most {MAX_BODY} bytes are accepted."
    return None


def _add_headers(headers: MutableHeaders, origin: str) -> None:
    for name, value in HEADERS.items():
        headers[name] = value
    headers.setdefault("Cache-Control", "no-store")
    sockets = origin.replace("http", "ws", 1)
    headers["Content-Security-Policy"] = (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; media-src 'self'; "
        f"connect-src 'self' {sockets}; base-uri 'none'; form-action 'self'; frame-ancestors 'none'"
    )


def _is_own(name: str) -> bool:
    if name in ("localhost", socket.gethostname().lower()):
        return True
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True
