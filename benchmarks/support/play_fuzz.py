"""Messages and requests to `mjsim play` that no page sends: the server refuses them, and nobody else notices."""

import asyncio
import json
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidStatus

from benchmarks.support.play_browser import SimulatedBrowser, begin_task
from benchmarks.support.play_server import PATIENCE, PlayProcess
from experiments.web.protocol import MAX_TEXT

MESSAGES_OF_A_CONNECTION = 45  # less than the refusals after which the server closes it
OVERSIZED = 0.01  # share of messages after which the server closes the connection
HELLO = {
    "type": "hello",
    "tab": "fuzzer-0000",
    "phase": "training",
    "view": {"type": "view", "width": 640, "height": 480, "codec": "none", "state": False},
}
PATHS = (
    "/",
    "/visits",
    "/play/",
    "/play/" + "A" * 43,
    "/play/%2e%2e%2fvisit.json",
    "/static/../server.py",
    "/static/..%2fserver.py",
    "/static/%2e%2e/%2e%2e/journal.py",
    "/static//etc/passwd",
    "/static/style.css%00",
    "/static/" + "x" * 4000,
    "/%ff%fe",
    "//evil.example/",
    "/play/" + "B" * 43 + "/floor-plan.png",
    "*",
    "http://evil.example/",
)
METHODS = ("GET", "HEAD", "POST", "PUT", "DELETE", "OPTIONS", "TRACE", "PATCH", "CONNECT", "get", "X" * 50)
HEADERS = (
    "Content-Length: -1",
    "Content-Length: 99999999999999999999",
    "Content-Length: 1e3",
    "Transfer-Encoding: chunked",
    "Host: evil.example",
    "Origin: null",
    "Origin: http://evil.example",
    "Range: bytes=9999999-1",
    "Range: bytes=0-0,1-1,2-2",
    "If-Modified-Since: never",
    "Upgrade: websocket",
    "Upgrade: h2c",
    "Connection: Upgrade",
    "Sec-WebSocket-Key: x",
    "Sec-WebSocket-Version: 99",
    "Expect: 100-continue",
    "Cookie: " + "c" * 3000,
    "X-Forwarded-Host: evil.example",
    "no colon",
    ": no name",
    "Accept-Encoding: \xff\xfe",
)


def odd_message(rng: np.random.Generator) -> str | bytes:
    """A message that is malformed, oversized, out of order or too early."""
    if rng.random() < OVERSIZED:
        return b"x" * (MAX_TEXT + int(rng.integers(1, 100)))
    return ODD[rng.integers(len(ODD))](rng)


def _noise(rng: np.random.Generator) -> bytes:
    return rng.bytes(int(rng.integers(0, 200)))


def _damaged(rng: np.random.Generator) -> str:
    text = list(json.dumps(HELLO))
    for place in rng.integers(0, len(text), 3):
        text[place] = chr(rng.integers(32, 0x2FF))
    return "".join(text)


def _inputs(rng: np.random.Generator) -> str:
    numbers = [int(n) for n in rng.integers(-5, 2**40, int(rng.integers(0, 80)))]
    return json.dumps({"type": "inputs", "inputs": [{"number": number} for number in numbers]})


def _values(rng: np.random.Generator) -> str:
    odd: list[Any] = [None, -1, 1e308, float("nan"), "x", [], {}, True, 2**70, "\x00", "ä" * 50]
    message: dict[str, Any] = dict(HELLO) if rng.random() < 0.5 else {"type": "seen", "frame": 1}
    message[str(rng.choice(list(message)))] = odd[rng.integers(len(odd))]
    return json.dumps(message)


ODD: tuple[Callable[[np.random.Generator], str | bytes], ...] = (
    _noise,
    _damaged,
    _inputs,
    _values,
    lambda rng: "[" * int(rng.integers(1, 20000)),
    lambda rng: '{"type":"pause","reason":"' + "y" * int(rng.integers(41, 60000)) + '"}',
    lambda rng: json.dumps({"type": "inputs", "inputs": [{"number": 1, "yaw": float(rng.normal(0, 1e6))}]}),
    lambda rng: str(
        rng.choice(['{"type":"begin"}', '{"type":"takeover"}', '{"type":"resume"}', "{}", "", "null"])
    ),
    lambda _: json.dumps({"type": "open", "folder": "/etc", "run": "/var/x"}),
)


def odd_request(rng: np.random.Generator, host: str, visit: str) -> bytes:
    """A request that no browser sends; some of them concern a visit, whose path is given."""
    if rng.random() < 0.1:
        return rng.bytes(int(rng.integers(1, 400))) + b"\r\n\r\n"
    path = visit + str(rng.choice(("", "/film", "/floor-plan.png", "/nothing")))
    path = str(rng.choice(PATHS)) if rng.random() < 0.6 else path
    lines = [f"{rng.choice(METHODS)} {path} HTTP/{rng.choice(['1.0', '1.1', '1.1', '9.9'])}"]
    if rng.random() < 0.9:
        lines.append(f"Host: {host}")
    if rng.random() < 0.3:
        lines.append(f"Origin: http://{host}")
    lines += [str(line) for line in rng.choice(HEADERS, int(rng.integers(0, 4)))]
    body = "z" * int(rng.choice([0, 0, 10, 10000]))
    return ("\r\n".join([*lines, "Connection: close", "", ""]) + body).encode("latin-1")


def measure_fuzz(folder: Path, messages: int, requests: int, seed: int, *words: str) -> dict[str, Any]:
    """Send odd messages and requests while somebody plays.

    Args:
        folder: Of the visits.
        messages: How many messages.
        requests: How many requests.
        seed: Of everything that chance decides.
        words: Further words of the server's command line.
    """
    with PlayProcess(folder, "--sessions", "2", *words) as server:
        result = asyncio.run(_fuzz(server, messages, requests, np.random.default_rng(seed)))
        running = server.process.poll() is None
    logged = server.output.read_text().count("Traceback")
    return {**result, "server_down": int(not running), "tracebacks_logged": logged}


async def _fuzz(
    server: PlayProcess, messages: int, requests: int, rng: np.random.Generator
) -> dict[str, Any]:
    bystander = SimulatedBrowser(server.begin())
    await begin_task(bystander)
    quiet, replies, sent = await _rounds(bystander, 20), list[bytes](), 0
    address = server.begin()
    playing = asyncio.create_task(_rounds(bystander, None))
    while sent < messages:
        count = min(MESSAGES_OF_A_CONNECTION, messages - sent)
        odd = [odd_message(rng) for _ in range(count)]
        sent += await _send_odd(address, odd, replies, hello=rng.random() < 0.5)
    for _ in range(requests):
        replies.append(await _request(server.url, odd_request(rng, *urlsplit(address)[1:3])))
    playing.cancel()
    disturbed = await playing
    await bystander.leave()
    kinds = [json.loads(reply)["code"] for reply in replies if reply.startswith(b'{"type":"error"')]
    statuses = [reply[9:12].decode("latin-1") for reply in replies if reply.startswith(b"HTTP/")]
    return {
        "messages": sent,
        "requests": requests,
        "refusals": {kind: kinds.count(kind) for kind in sorted(set(kinds))},
        "statuses": {status: statuses.count(status) for status in sorted(set(statuses))},
        "server_errors": sum(status.startswith("5") for status in statuses),
        "tracebacks": sum(b"Traceback" in reply or b'File "' in reply for reply in replies),
        "bystander_cut_off": int("closed" in bystander.last and "over" not in bystander.last),
        "bystander_p95_s": [float(np.percentile(times, 95)) for times in (quiet, disturbed)],
    }


async def _rounds(browser: SimulatedBrowser, count: int | None) -> list[float]:
    """Times from an input to its acknowledgement, s; until cancelled where there is no count."""
    times: list[float] = []
    with suppress(asyncio.CancelledError, ConnectionError):
        while count is None or len(times) < count:
            began = time.perf_counter()
            browser.press(turn=float(len(times) % 3 - 1))
            await browser.taken()
            times.append(time.perf_counter() - began)
            await asyncio.sleep(0.05)
    return times


async def _send_odd(address: str, odd: list[str | bytes], replies: list[bytes], *, hello: bool) -> int:
    """Send messages on a connection until it is closed, and keep what is answered; how many were sent."""
    parts, sent = urlsplit(address), 0
    with suppress(ConnectionClosed, InvalidStatus, OSError):
        async with connect(
            f"ws://{parts.netloc}{parts.path}",
            origin=f"http://{parts.netloc}",  # type: ignore[arg-type]
            max_size=None,
            open_timeout=PATIENCE,
        ) as socket:
            reading = asyncio.create_task(_read(socket, replies))
            if hello:
                await socket.send(json.dumps(HELLO))
            for message in odd:
                with suppress(UnicodeEncodeError):
                    await socket.send(message)
                    sent += 1
            await (await socket.ping())
            await asyncio.wait([reading], timeout=0.05)
            reading.cancel()
    return sent


async def _read(socket: ClientConnection, replies: list[bytes]) -> None:
    with suppress(ConnectionClosed):
        while True:
            reply = await socket.recv()
            replies.append(reply if isinstance(reply, bytes) else reply.encode())


async def _request(url: str, content: bytes) -> bytes:
    """What is answered to a request; nothing if the connection is closed."""
    parts = urlsplit(url)
    reader, writer = await asyncio.open_connection(parts.hostname, parts.port)
    reply = b""
    with suppress(OSError, TimeoutError):
        writer.write(content)
        await writer.drain()
        writer.write_eof()
        reply = await asyncio.wait_for(reader.read(), PATIENCE)
    writer.close()
    with suppress(OSError):
        await writer.wait_closed()
    return reply
