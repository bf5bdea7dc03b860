"""Options, sockets, locks and logging for commands that run a server."""

import argparse
import asyncio
import fcntl
import json
import logging
import os
import resource
import socket
import threading
import traceback
import webbrowser
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from ipaddress import IPv4Network, IPv6Network, ip_network
from pathlib import Path
from typing import Any

from experiments.errors import ConfigError, RecordError
from mjsim.support.urls import parse_url, redacted

PORT = 8000
BACKLOG = 1024  # maximum number of connections waiting to be accepted
MAX_FILES = 16384  # limit on open files, including sockets


def add_server_options(group: Any) -> None:
    group.add_argument("--port", type=number(0, 65535), default=PORT, help="TCP port, or 0 for any free port")
    group.add_argument(
        "--host", type=address, default="127.0.0.1", metavar="ADDRESS", help="address to listen on"
    )
    group.add_argument(
        "--public-url", metavar="URL", help="public URL of the server behind a proxy (docs/deploy.md)"
    )
    group.add_argument(
        "--trusted-proxy",
        type=_networks,
        default=(),
        metavar="ADDRESS,..",
        help="addresses or networks of proxies whose X-Forwarded-For header is trusted (docs/deploy.md)",
    )
    group.add_argument("--log-json", action="store_true", help="write the log as JSON, one object per line")
    group.add_argument("--no-open", action="store_true", help="do not open a browser")


def prepare_process() -> None:
    """Make new files private to the current user, and raise the limit on open files."""
    os.umask(0o077)  # participants' data must not be readable by other users
    _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(most, MAX_FILES) if most > 0 else MAX_FILES, most))


async def serve(
    app: Any,
    listener: socket.socket,
    arguments: argparse.Namespace,
    others: Sequence[tuple[Any, socket.socket]] = (),
) -> None:
    """Serve an ASGI application, and those in `others`, until a signal arrives.

    The URLs are printed one per line, and a browser opens the first. The applications stop in reverse order.
    """
    begin_logging(as_json=arguments.log_json)
    url = arguments.public_url or url_of(listener)
    print(url, *(url_of(at) for _, at in others), sep="\n", flush=True)
    if not arguments.no_open:
        threading.Thread(target=webbrowser.open, args=(url,), daemon=True).start()
    # The most recently started server handles a signal first and then passes it to the previous server.
    await asyncio.gather(*(http_server(one).serve([at]) for one, at in ((app, listener), *others)))


def http_server(app: Any) -> Any:
    """Create an HTTP server for an ASGI application, with the limits that all servers of mjsim share."""
    import uvicorn  # imported here so that commands start fast

    from experiments.web.protocol import MAX_TEXT
    from experiments.web.server.guards import TimedConnection

    return uvicorn.Server(
        uvicorn.Config(
            app,
            log_config=None,
            access_log=False,  # URL paths contain secret tokens, which must not be logged
            log_level="warning",
            server_header=False,
            proxy_headers=False,  # the `Guards` middleware handles these headers instead
            http=TimedConnection,
            ws="websockets-sansio",
            ws_max_size=MAX_TEXT,
            ws_ping_interval=5.0,
            ws_ping_timeout=10.0,
            ws_per_message_deflate=True,
            timeout_graceful_shutdown=3,
            limit_concurrency=4000,
        )
    )


def listen(host: str, port: int) -> socket.socket:
    try:
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        return socket.create_server((host, port), family=family, backlog=BACKLOG)
    except OSError as error:
        place = f"cannot listen at {host}, port {port}"
        raise OSError(
            error.errno, f"{place}: {error.strerror}; choose another --port (0 for any) or --host"
        ) from error


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Lock a folder so that no other server can use it."""
    folder.mkdir(parents=True, exist_ok=True)
    handle = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        yield
    except BlockingIOError as error:
        raise RecordError(f"{folder} is in use by another server; choose another --out") from error
    finally:
        os.close(handle)


def check_public_url(url: str | None) -> None:
    """Raise ConfigError unless the public URL has the form `https://play.example.org` or is None."""
    if url is None:
        return
    try:
        parts = parse_url(url)
        alone = not (parts.path.strip("/") or parts.query or parts.fragment or parts.username)
    except ValueError:
        alone = False
    if not alone:
        raise ConfigError(f"public URL {redacted(url)!r} must be of the form https://play.example.org")


def url_of(listener: socket.socket) -> str:
    """Return the local URL of a listening socket."""
    host, port = listener.getsockname()[:2]
    shown = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host)
    return f"http://[{shown}]:{port}/" if ":" in shown else f"http://{shown}:{port}/"


def address(text: str) -> str:
    """Refuse an empty address, with which a socket would listen on all addresses."""
    if not text.strip():
        raise argparse.ArgumentTypeError("is empty; name an address, or 0.0.0.0 for all")
    return text


def _networks(text: str) -> tuple[IPv4Network | IPv6Network, ...]:
    try:
        return tuple(ip_network(part.strip()) for part in text.split(","))
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def number(smallest: float, largest: float, kind: type[float] = int) -> Callable[[str], float]:
    """Return a function that parses a number between the given limits, which is an integer by default."""

    def parse(text: str) -> float:
        with suppress(ValueError):
            if smallest <= (value := kind(text)) <= largest:
                return value
        raise argparse.ArgumentTypeError(f"{text!r} is not a number from {smallest} to {largest}")

    return parse


class JsonLines(logging.Formatter):
    """A log formatter that writes each record as a JSON object with time, level, logger and message.

    Only the type and traceback of an exception are logged, because its message may contain personal data.
    """

    def format(self, record: logging.LogRecord) -> str:
        line: dict[str, object] = {
            "time": datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds"),
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": record.getMessage(),
        }
        if record.exc_info and record.exc_info[0] is not None:
            kind, _, trace = record.exc_info
            line["error"] = kind.__name__
            line["at"] = [f"{at.filename}:{at.lineno} {at.name}" for at in traceback.extract_tb(trace)]
        return json.dumps(line)


def begin_logging(*, as_json: bool) -> None:
    handler = logging.StreamHandler()
    handler.setFormatter(JsonLines() if as_json else logging.Formatter("%(asctime)s %(message)s", "%H:%M:%S"))
    logging.basicConfig(handlers=[handler])
    for name in ("mjsim.play", "mjsim.study"):
        logging.getLogger(name).setLevel(logging.INFO)
