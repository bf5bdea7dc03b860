"""One hostile machine before a server of `mjsim play`, directly and through NGINX, and what others notice of it."""

import asyncio
import json
import multiprocessing
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, suppress
from itertools import count
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import httpx
from nginx_site import NGINX
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import WebSocketException
from websockets.protocol import State

from benchmarks.support.play_browser import SimulatedBrowser
from benchmarks.support.play_server import PATIENCE, TASK_ALONE, PlayProcess
from benchmarks.support.ports import free_ports, listens
from experiments.record.phases import TASK
from experiments.web.protocol import MAX_INPUTS

HOSTILE, OTHER = "127.0.0.66", "127.0.0.2"  # addresses of the hostile machine, and of who opens new visits
CLOSING_S = 0.5  # time for the close frames of replaced sockets to arrive, in seconds
SPOOFED = 60  # visits that the hostile machine begins in the names of others
DOCUMENT = Path(__file__).parents[3] / "docs" / "browser.md"
MAIN = """daemon off; pid {folder}/pid; error_log {folder}/error.log; worker_rlimit_nofile 16384;
events {{ worker_connections 8192; }}
http {{ access_log off; client_body_temp_path {folder}/body; proxy_temp_path {folder}/proxy;
  fastcgi_temp_path {folder}/f; uwsgi_temp_path {folder}/u; scgi_temp_path {folder}/s;
  server {{ listen 127.0.0.1:{port}; {location} }} }}
"""


def measure_hostile(folder: Path, number: int, seconds: float, *words: str, nginx: bool) -> dict[str, Any]:
    """What another person and new visitors notice while one machine does what it can.

    Args:
        folder: Of the visits.
        number: Of its half-sent requests, and of its sockets of one visit.
        seconds: How long others are watched meanwhile.
        words: Further words of the server's command line.
        nginx: Whether all come through NGINX.
    """
    front, port = free_ports(2)
    proxy = ("--public-url", f"http://127.0.0.1:{front}", "--trusted-proxy", "127.0.0.1") if nginx else ()
    server = PlayProcess(folder / "visits", *TASK_ALONE, "--sessions", "3", *proxy, *words)
    server.url = f"http://127.0.0.1:{port}"
    with server, _nginx(folder / "nginx", front, port) if nginx else nullcontext():
        found = asyncio.run(_watch(server, number, seconds))
        flooded = server.journal(found.pop("flooded"), TASK).stat().st_size
    return {**found, "journal_kb": flooded / 1000.0, "errors": server.output.read_text().count("Traceback")}


@contextmanager
def _nginx(folder: Path, port: int, server: int) -> Iterator[None]:
    """NGINX with the configuration of docs/browser.md."""
    folder.mkdir()
    location = DOCUMENT.read_text().split("```nginx\n")[1].split("```")[0].replace(":8000", f":{server}")
    (folder / "nginx.conf").write_text(MAIN.format(folder=folder, port=port, location=location))
    process = subprocess.Popen([str(NGINX), "-c", str(folder / "nginx.conf")], stderr=subprocess.DEVNULL)
    try:
        until = time.monotonic() + PATIENCE
        while not listens(port) and time.monotonic() < until:
            time.sleep(0.05)
        yield
    finally:
        process.terminate()
        process.wait()


async def _watch(server: PlayProcess, number: int, seconds: float) -> dict[str, Any]:
    """Watch another person and new visits while a process attacks; what came of both."""
    person = SimulatedBrowser(server.begin())
    await person.open(TASK)
    await person.run()
    flooded, shared = server.begin(), server.begin()
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    hostile = context.Process(target=_attack, args=(theirs, server.url, flooded, shared, number), daemon=True)
    hostile.start()
    theirs.close()
    await asyncio.to_thread(ours.recv)  # it begins
    person.forget()
    opening, began = list[float](), time.perf_counter()
    while time.perf_counter() - began < seconds:
        opening.append(await asyncio.to_thread(_open_visit, server.url))
        await asyncio.sleep(1.0)
    rate = len(person.frames) / (time.perf_counter() - began)
    done = (await asyncio.to_thread(ours.recv)) if await asyncio.to_thread(ours.poll, PATIENCE) else {}
    hostile.kill()
    hostile.join()
    await person.leave()
    return {"states_per_s": rate, "slowest_visit_s": max(opening), "flooded": flooded, **done}


def _open_visit(url: str) -> float:
    """How long a new visit takes to open, with its first page, s."""
    began = time.perf_counter()
    transport = httpx.HTTPTransport(local_address=OTHER)
    headers = {"Origin": url.rstrip("/")}
    with httpx.Client(base_url=url, transport=transport, timeout=PATIENCE, headers=headers) as client:
        client.get("/").raise_for_status()
        client.post("/begin", follow_redirects=True).raise_for_status()
    return time.perf_counter() - began


def _attack(results: Any, url: str, flooded: str, shared: str, number: int) -> None:
    """Do what a hostile machine does; runs in a process of its own, until it is killed."""
    asyncio.run(_attack_at_once(results, url, flooded, shared, number))


async def _attack_at_once(results: Any, url: str, flooded: str, shared: str, number: int) -> None:
    results.send("begins")
    cut_off, (_connections, still_open), begun, _writers = await asyncio.gather(
        _flood(flooded, number), _open_sockets(shared, number), _spoof(url), _half_send(url, number)
    )
    results.send({"flood_cut_off": cut_off, "sockets_open": still_open, "visits_begun": begun})
    await asyncio.Event().wait()  # the connections stay open


async def _flood(address: str, number: int) -> bool:
    """Messages full of presses of a key; whether the server had enough of it."""
    browser = SimulatedBrowser(address)
    await browser.open(TASK)
    numbers = count(await browser.run() + 1)
    for _ in range(number):
        inputs = [{"number": next(numbers), "press": "act"} for _ in range(MAX_INPUTS)]
        browser.say(type="inputs", inputs=inputs)
        await asyncio.sleep(0.005)
        if "closed" in browser.last:
            return True
    return False


async def _open_sockets(address: str, number: int) -> tuple[list[ClientConnection], int]:
    """Open sockets of one visit, each with a hello. Return them, and the number that the server leaves open.

    A later socket may replace a silent one, which the server closes. So more sockets than the limit may be served
    in turn.
    """
    parts, served = urlsplit(address), list[ClientConnection]()
    view = {"type": "view", "width": 640, "height": 480, "codec": "none"}
    for i in range(number):
        with suppress(WebSocketException, OSError, TimeoutError):
            connection = await connect(
                f"ws://{parts.netloc}{parts.path}",
                origin=f"http://{parts.netloc}",  # type: ignore[arg-type]
                local_addr=(HOSTILE, 0),
                max_queue=None,  # read everything, so that a closed connection is noticed
            )
            served.append(connection)
            hello = {"type": "hello", "tab": f"hostile-{i:05}", "trial": TASK, "view": view}
            await connection.send(json.dumps(hello))
    await asyncio.sleep(CLOSING_S)
    return served, sum(connection.state is State.OPEN for connection in served)


async def _spoof(url: str) -> int:
    """Visits in the names of other machines; how many could be begun."""
    begun = 0
    transport = httpx.AsyncHTTPTransport(local_address=HOSTILE)
    async with httpx.AsyncClient(base_url=url, transport=transport, timeout=PATIENCE) as client:
        for i in range(SPOOFED):
            headers = {"Origin": url.rstrip("/"), "X-Forwarded-For": f"198.51.100.{i}"}
            with suppress(httpx.TransportError):  # it made room for others
                begun += (await client.post("/begin", headers=headers)).status_code == 303
    return begun


async def _half_send(url: str, number: int) -> list[asyncio.StreamWriter]:
    """Begin requests without ending their head or body; their connections."""
    parts, writers = urlsplit(url), list[asyncio.StreamWriter]()
    head = f"POST /begin HTTP/1.1\r\nHost: {parts.netloc}\r\nOrigin: http://{parts.netloc}\r\n"
    for i in range(number):
        with suppress(OSError):
            _, writer = await asyncio.open_connection(parts.hostname, parts.port, local_addr=(HOSTILE, 0))
            writer.write((head + ("", "Content-Length: 9\r\n\r\nopene")[i % 2]).encode())
            writers.append(writer)
    return writers
