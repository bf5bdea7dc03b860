"""Request checks, response headers and connection limits of the web servers."""

import asyncio
import re
import socket
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from ipaddress import IPv4Address, IPv4Network, IPv6Address, IPv6Network, ip_address, ip_network
from typing import Any, ClassVar
from urllib.parse import parse_qsl, urlsplit

import h11
from starlette.datastructures import Headers, ImmutableMultiDict, MutableHeaders
from starlette.middleware import Middleware
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import Request
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from uvicorn.protocols.http.h11_impl import H11Protocol

from experiments.web.client_files import static_caching

MAX_BODY = 4096  # maximum size of a request body, in bytes
HOST = re.compile(r"([A-Za-z0-9.-]+|\[[0-9A-Fa-f:.]+\])(:\d{1,5})?")
UNCACHED = "no-store"  # `Cache-Control` header of rendered pages
Address = IPv4Address | IPv6Address
Network = IPv4Network | IPv6Network
HEADERS = {
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), microphone=(), geolocation=()",
}
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; media-src 'self'; "
    "connect-src 'self' blob: {sockets}; base-uri 'none'; form-action {forms}; frame-ancestors {frames}"
)
MAX_FIELDS = 500
REQUEST_TIMEOUT = 10.0  # timeout for receiving a complete request, in seconds
MAX_OPEN = 2000  # maximum number of open connections, not counting WebSockets


def allowed_hosts(host: str, public: str | None) -> Sequence[str]:
    """Return the host names that a server at `host` accepts. Rejecting others prevents DNS rebinding."""
    addresses = {host, "127.0.0.1", "::1"}
    if host in ("0.0.0.0", "::"):
        addresses |= _own_addresses()
    names = {f"[{address}]" if ":" in address else address for address in addresses}
    public_name = urlsplit(public or "").hostname
    return sorted({*names, "localhost", socket.gethostname().lower(), public_name or "localhost"})


def _own_addresses() -> set[str]:
    found = set()
    for family, target in ((socket.AF_INET, "192.0.2.1"), (socket.AF_INET6, "2001:db8::1")):
        try:
            with socket.socket(family, socket.SOCK_DGRAM) as probe:
                probe.connect((target, 9))  # selects the outgoing interface without sending a packet
                found.add(str(probe.getsockname()[0]))
            found |= {str(info[4][0]) for info in socket.getaddrinfo(socket.gethostname(), None, family)}
        except OSError:
            continue  # the machine has no network with this address family
    return found


def middleware(host: str, public: str | None, proxies: Sequence[Network], **options: Any) -> list[Middleware]:
    hosts = allowed_hosts(host, public)
    return [
        Middleware(TrustedHostMiddleware, allowed_hosts=hosts, www_redirect=False),
        Middleware(Guards, public=public, proxies=proxies, **options),
    ]


class Guards:
    """ASGI middleware that checks requests, limits their size, sets the client's address and adds response headers.

    The headers `Host` and `Origin` are checked. X-Forwarded-For is trusted only in requests from `proxies`. Only sites
    in `embedded_by`, such as https://example.org, may embed pages in frames and receive submitted forms.
    """

    def __init__(
        self,
        app: ASGIApp,
        public: str | None,
        proxies: Sequence[Network] = (),
        max_body: int = MAX_BODY,
        embedded_by: Sequence[str] = (),
    ) -> None:
        self._app, self._proxies, self._max_body = app, proxies, max_body
        self._embedded_by = tuple(embedded_by)
        self._public = urlsplit(public or "")

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        origin = self._origin(headers.get("host", ""))
        refusal = _refusal(scope, headers, origin, self._max_body)
        if scope["type"] == "websocket" and refusal is not None:
            await receive()
            await send({"type": "websocket.close", "code": 1008})
            return

        cache = static_caching(scope["path"]) or UNCACHED

        async def send_guarded(message: Message) -> None:
            if message["type"] == "http.response.start":
                _add_headers(MutableHeaders(scope=message), origin, cache, self._embedded_by)
            await send(message)

        if scope["type"] == "http" and refusal is None:
            whole = await _whole(receive)
            if whole is None:
                return
            receive = whole
        app = self._app if refusal is None else PlainTextResponse(f"{refusal[1]}\n", refusal[0])
        await app({**scope, "client": (self._sender(scope, headers), 0)}, receive, send_guarded)

    def _sender(self, scope: Scope, headers: Headers) -> str:
        peer = address_of((scope.get("client") or ("",))[0])
        if any(peer is not None and peer in proxy for proxy in self._proxies):
            # Use the last address, which is set by the proxy. Clients can forge the others.
            forwarded = ",".join(headers.getlist("x-forwarded-for")).rpartition(",")[2]
            peer = address_of(forwarded.strip()) or peer
        return machine_of(peer)

    def _origin(self, host: str) -> str:
        """Return the origin that a `Host` header implies, or an empty string if the header is not valid."""
        if not HOST.fullmatch(host):
            return ""
        public = host == self._public.netloc and self._public.scheme == "https"
        return f"{'https' if public else 'http'}://{host}"


class Rate:
    """A rate limit of `count` requests per address within `period` seconds."""

    def __init__(self, count: int, period: float) -> None:
        self._count, self._period = count, period
        self._log: list[tuple[float, str, str]] = []

    def allows(self, address: str, sender: str = "") -> bool:
        """Count a request. Return True if it is within the limit.

        Args:
            sender: Identity of the sender, or empty if it is unknown. All requests of a known sender count as one.
        """
        now = time.monotonic()
        self._log = [one for one in self._log if now - one[0] < self._period]
        if sender and any(one[1:] == (address, sender) for one in self._log):
            return True
        allowed = sum(one[1] == address for one in self._log) < self._count
        self._log += [(now, address, sender)] * allowed
        return allowed


def address_of(text: str) -> Address | None:
    try:
        found = ip_address(text)
    except ValueError:
        return None
    return (found.ipv4_mapped or found) if isinstance(found, IPv6Address) else found


def machine_of(address: Address | None) -> str:
    """Return an IPv4 address, or the /64 network of an IPv6 address, as one machine may use all of it."""
    return str(ip_network((address, 64), strict=False) if isinstance(address, IPv6Address) else address)


async def _whole(receive: Receive) -> Receive | None:
    """Read the request body. Return a `receive` function for it, or None if the client has disconnected."""
    body = b""
    while (message := await receive())["type"] == "http.request":
        body += message.get("body", b"")
        if not message.get("more_body", False):
            break
    else:
        return None
    first: list[Message] = [{"type": "http.request", "body": body}]

    async def receive_whole() -> Message:
        return first.pop() if first else await receive()

    return receive_whole


def _refusal(scope: Scope, headers: Mapping[str, str], origin: str, max_body: int) -> tuple[int, str] | None:
    if not origin:
        return 400, "Invalid host header"
    changes = scope["type"] == "websocket" or scope["method"] not in ("GET", "HEAD")
    if changes and headers.get("origin") != origin:
        return 403, "This request does not come from a page of this server."
    length = headers.get("content-length", "0")
    if "transfer-encoding" in headers or not length.isdecimal() or int(length) > max_body:
        return 413, f"At most {max_body} bytes are accepted."
    return None


def _add_headers(headers: MutableHeaders, origin: str, cache: str, embedded_by: Sequence[str]) -> None:
    for name, value in HEADERS.items():
        headers[name] = value
    if embedded_by:
        del headers["X-Frame-Options"]  # this header cannot allow individual sites
    headers.setdefault("Cache-Control", cache)
    headers["Content-Security-Policy"] = POLICY.format(
        sockets=origin.replace("http", "ws", 1),
        forms=" ".join(("'self'", *embedded_by)),
        frames=" ".join(embedded_by) or "'none'",
    )


async def sent_form(request: Request) -> ImmutableMultiDict[str, str]:
    """Return the fields of a submitted form, or an empty mapping if the form is malformed or too large."""
    text = (await request.body()).decode("utf-8", "replace")
    try:
        return ImmutableMultiDict(parse_qsl(text, keep_blank_values=True, max_num_fields=MAX_FIELDS))
    except ValueError:
        return ImmutableMultiDict()


class TimedConnection(H11Protocol):
    """A uvicorn connection with timeouts and an overall limit on the number of connections.

    If the limit is exceeded, the oldest connection of the address with the most connections is closed.
    """

    _open: ClassVar[dict["TimedConnection", str]] = {}  # address of each open connection, oldest first
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
        """Exempt a WebSocket connection from the limits, because WebSockets have limits of their own."""
        self._forget()
        super().handle_websocket_upgrade(event)

    def _watch(self) -> None:
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
