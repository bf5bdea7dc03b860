"""Messages and requests to `mjsim play` that no page sends: the server refuses them, and other sessions continue."""

import asyncio
import json
import os
import re
from collections import Counter
from contextlib import suppress
from urllib.parse import urlsplit

import numpy as np
import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed, InvalidStatus

from benchmarks.play import FAST
from benchmarks.support.play_browser import SimulatedBrowser, begin_task
from benchmarks.support.play_server import PATIENCE, PlayProcess
from experiments.web.protocol import MAX_TEXT

MESSAGES_OF_A_CONNECTION = 45  # less than the refusals after which the server closes it
OVERSIZED = 0.01  # share of messages after which the server closes the connection
HELLO = {
    "type": "hello",
    "tab": "fuzzer-0000",
    "trial": "training",
    "view": {"type": "view", "width": 640, "height": 480, "codec": "none"},
}
VALUES = [None, -1, 1e308, float("nan"), "x", [], {}, True, 2**70, "\x00", "ä" * 50]
SMALL = ['{"type":"run"}', '{"type":"takeover"}', '{"type":"leave","x":1}', "{}", "", "null"]
PATHS = ("/", "/begin", "/%ff%fe", "//evil.example/", "*", "http://evil.example/", "/play/" + "A" * 43)
PATHS += ("/static/../app.py", "/static/..%2f..%2fapp.py", "/static/style.css%00", "/static/" + "x" * 4000)
METHODS = ("GET", "HEAD", "POST", "PUT", "DELETE", "OPTIONS", "TRACE", "PATCH", "CONNECT", "get", "X" * 50)
HEADERS = ["Content-Length: -1", "Content-Length: 1e3", "Host: evil.example", "Origin: null", "Upgrade: h2c"]
HEADERS += ["Range: bytes=9999999-1", "Range: bytes=0-0,1-1,2-2", "Cookie: " + "c" * 3000, ": no name"]
HEADERS += ["Transfer-Encoding: chunked", "If-Modified-Since: never", "Connection: Upgrade", "no colon"]
HEADERS += ["Sec-WebSocket-Version: 99", "Expect: 100-continue", "Accept-Encoding: \xff\xfe"]


def odd_message(rng):
    """A message that is malformed, oversized, out of order or too early."""
    if rng.random() < OVERSIZED:
        return b"x" * (MAX_TEXT + int(rng.integers(1, 100)))
    match rng.integers(5):
        case 0:
            return rng.bytes(int(rng.integers(0, 200)))
        case 1:
            text = list(json.dumps(HELLO))
            for place in rng.integers(0, len(text), 3):
                text[place] = chr(rng.integers(32, 0x2FF))
            return "".join(text)
        case 2:
            numbers = [int(n) for n in rng.integers(-5, 2**40, int(rng.integers(0, 80)))]
            return json.dumps({"type": "inputs", "inputs": [{"number": number} for number in numbers]})
        case 3:
            message = dict(HELLO) if rng.random() < 0.5 else {"type": "seen", "frame": 1}
            message[str(rng.choice(list(message)))] = VALUES[rng.integers(len(VALUES))]
            return json.dumps(message)
    return str(rng.choice(SMALL))


def odd_request(rng, host, visit):
    """A request that no browser sends; some of them concern a visit, whose path is given."""
    if rng.random() < 0.1:
        return rng.bytes(int(rng.integers(1, 400))) + b"\r\n\r\n"
    path = visit + str(rng.choice(("", "/film", "/floor-plan.png", "/nothing")))
    path = str(rng.choice(PATHS)) if rng.random() < 0.6 else path
    lines = [f"{rng.choice(METHODS)} {path} HTTP/{rng.choice(['1.0', '1.1', '1.1', '9.9'])}"]
    lines += [f"Host: {host}"] * (rng.random() < 0.9) + [f"Origin: http://{host}"] * (rng.random() < 0.3)
    lines += [str(line) for line in rng.choice(HEADERS, int(rng.integers(0, 4)))]
    body = "z" * int(rng.choice([0, 0, 10, 10000]))
    return ("\r\n".join([*lines, "Connection: close", "", ""]) + body).encode("latin-1")


async def send_odd(address, messages, hello):
    """Send messages on a connection until it is closed; the answers."""
    parts, answers = urlsplit(address), []
    with suppress(ConnectionClosed, InvalidStatus, OSError, TimeoutError):
        url = f"ws://{parts.netloc}{parts.path}"
        async with connect(
            url, origin=f"http://{parts.netloc}", max_size=None, max_queue=None, open_timeout=PATIENCE
        ) as socket:
            with suppress(ConnectionClosed):  # answers that came before can still be read
                for message in [json.dumps(HELLO)] * hello + messages:
                    with suppress(UnicodeEncodeError):
                        await socket.send(message)
                await (await socket.ping())
            async with asyncio.timeout(0.5):
                while True:
                    answers.append(await socket.recv())
    return answers


async def request(url, content):
    """The answer to a request; nothing if the connection is closed."""
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


async def play_along(browser):
    """Press keys; each has to be acknowledged soon."""
    while True:
        browser.press(turn=float(browser.next % 3 - 1))
        await browser.taken()
        await asyncio.sleep(0.05)


async def disturb(server, messages, requests, rng):
    """Send odd messages and requests while another person plays; answers to both."""
    bystander = SimulatedBrowser(server.begin())
    await begin_task(bystander)
    playing = asyncio.create_task(play_along(bystander))
    address, answers, replies = server.begin(), [], []
    for _ in range(0, messages, MESSAGES_OF_A_CONNECTION):
        odd = [odd_message(rng) for _ in range(MESSAGES_OF_A_CONNECTION)]
        answers += await send_odd(address, odd, rng.random() < 0.5)
    for _ in range(requests):
        replies.append(await request(server.url, odd_request(rng, *urlsplit(address)[1:3])))
    assert not playing.done(), "the other session continues"
    playing.cancel()
    await bystander.close()
    return answers, replies


@pytest.mark.slow
@pytest.mark.long
def test_odd_messages_and_requests_are_refused_and_disturb_nobody(tmp_path):
    count = int(os.environ.get("MJSIM_FAULTS", "4000"))
    with PlayProcess(tmp_path / "visits", "--sessions", "2", *FAST) as server:
        answers, replies = asyncio.run(disturb(server, count, count // 5, np.random.default_rng(count)))
        assert server.process.poll() is None
    assert "Traceback" not in server.output.read_text()
    assert not any(b"Traceback" in reply for reply in replies)
    statuses = Counter(match[1] for reply in replies if (match := re.match(rb"HTTP/1.1 (\d)", reply)))
    assert statuses[b"4"] and not statuses[b"5"]
    codes = {answer["code"] for answer in map(json.loads, answers) if answer["type"] == "error"}
    assert {"malformed", "too early"} <= codes
