"""What the commands that serve pages share: where they listen, who may reach them, how they run."""

import argparse
import asyncio
import fcntl
import os
import resource
import socket
import threading
import webbrowser
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from ipaddress import IPv4Network, IPv6Network, ip_network
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from experiments.cli.logs import begin_logging
from experiments.errors import ConfigError, RecordError

PORT = 8000
BACKLOG = 1024  # connections that wait to be taken
MAX_FILES = 16384  # open files, sockets included


def add_server_options(group: Any) -> None:
    """Add the options of a server to a group of a parser."""
    group.add_argument("--port", type=number(0, 65535), default=PORT, help="TCP port; 0 for any that is free")
    group.add_argument("--host", default="127.0.0.1", metavar="ADDRESS", help="address to listen at")
    group.add_argument(
        "--public-url", metavar="URL", help="URL under which a proxy makes the server public (docs/deploy.md)"
    )
    group.add_argument(
        "--trusted-proxy",
        type=_networks,
        default=(),
        metavar="ADDRESS,..",
        help="addresses or networks of proxies whose X-Forwarded-For tells who asks (docs/deploy.md)",
    )
    group.add_argument("--log-json", action="store_true", help="write the log as a JSON object a line")
    group.add_argument("--no-open", action="store_true", help="open no browser")


def prepare_process() -> None:
    """Let this process keep what it writes to itself, and open many sockets."""
    os.umask(0o077)  # what people did is nobody else's business
    _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(most, MAX_FILES) if most > 0 else MAX_FILES, most))


async def serve(
    app: Any,
    listener: socket.socket,
    arguments: argparse.Namespace,
    beside: Sequence[tuple[Any, socket.socket]] = (),
) -> None:
    """Print the URL of an ASGI application, open it, and serve until a signal comes, as well as those `beside`.

    Where those listen is printed a line each. The first application starts first and ends last.
    """
    begin_logging(as_json=arguments.log_json)
    url = arguments.public_url or url_of(listener)
    print(url, *(url_of(at) for _, at in beside), sep="\n", flush=True)
    if not arguments.no_open:
        threading.Thread(target=webbrowser.open, args=(url,), daemon=True).start()
    # Each hears a signal once the one after it has ended.
    await asyncio.gather(*(http_server(one).serve([at]) for one, at in ((app, listener), *beside)))


def http_server(app: Any) -> Any:
    """A server of an ASGI application, with the limits that all servers here have."""
    import uvicorn  # imported here, so that other commands start fast

    from experiments.web.protocol import MAX_TEXT
    from experiments.web.server.guards import TimedConnection

    return uvicorn.Server(
        uvicorn.Config(
            app,
            log_config=None,
            access_log=False,  # paths hold tokens
            log_level="warning",
            server_header=False,
            proxy_headers=False,  # the guards believe those that are named
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
            error.errno, f"{place}: {error.strerror}; name another --port (0 for any) or --host"
        ) from error


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Keep other servers away from a folder."""
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
    """Raise a ConfigError unless a URL is that of a whole site; None is none."""
    if url is None:
        return
    parts = urlsplit(url)
    if parts.scheme not in ("http", "https") or not parts.netloc or parts.path not in ("", "/"):
        raise ConfigError(f"public URL {url!r} must be of the form https://play.example.org")


def url_of(listener: socket.socket) -> str:
    """The URL at which this machine reaches a socket that listens."""
    host, port = listener.getsockname()[:2]
    shown = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host)
    return f"http://[{shown}]:{port}/" if ":" in shown else f"http://{shown}:{port}/"


def _networks(text: str) -> tuple[IPv4Network | IPv6Network, ...]:
    try:
        return tuple(ip_network(part.strip()) for part in text.split(","))
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def number(smallest: int, largest: int) -> Callable[[str], int]:
    """Parser of a whole number in a range."""

    def parse(text: str) -> int:
        if not text.isdecimal() or not smallest <= int(text) <= largest:
            raise argparse.ArgumentTypeError(f"{text!r} is not a number from {smallest} to {largest}")
        return int(text)

    return parse
