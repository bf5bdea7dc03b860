"""Simulate participants who arrive at a study simultaneously from different addresses, over real HTTP."""

import asyncio
import json
import time
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import urlencode, urlsplit

from benchmarks.support.play_server import PATIENCE, PlayProcess

PROXIED = ("--trusted-proxy", "127.0.0.1")  # X-Forwarded-For contains the participant's address
TASK_PAGES = 'data-trial="task"', 'http-equiv="refresh"'  # text that identifies the task page and the queue
STUDY = """
[[cells]]
assistance = "none"
objects = 1
people = {people}
house_seeds = 0
fidelity = "{fidelity}"

[[cells]]
assistance = "optimal"
objects = 1
people = {people}
house_seeds = 0
fidelity = "{fidelity}"

[study]
name = "small"
title = "A small study"
institution = "a test"
contact = "study@example.org"
phases = {phases}
"""


def study_process(
    folder: Path,
    *words: str,
    people: int = 250,
    sessions: int = 20,
    fidelity: str = "event",
    phases: Sequence[str] = ("consent", "task", "completion"),
) -> PlayProcess:
    """Return a server process for a small study with two cells of `people` participants each."""
    values = {"people": people, "fidelity": fidelity, "phases": json.dumps(phases)}
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / "study.toml"
    file.write_text(STUDY.format(**values))
    words = (*PROXIED, "--workers", str(sessions), *words)
    return PlayProcess(folder / "out", *words, command=("study", "serve", str(file)))


@dataclass(frozen=True)
class HttpResponse:
    """A response of the server."""

    status: int
    headers: Mapping[str, str]
    body: str


@dataclass
class Times:
    """Response times in seconds, by name of the page, and descriptions of failed requests."""

    pages: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    failed: list[str] = field(default_factory=list)

    @property
    def slowest(self) -> float:
        return max((seconds for times in self.pages.values() for seconds in times), default=0.0)


async def ask(
    url: str,
    path: str,
    form: Mapping[str, str] | None = None,
    number: int = 0,
    cookie: str = "",
    patience: float = PATIENCE,
) -> HttpResponse:
    """Request a page or post a form as participant `number`, on a new connection.

    Raises:
        OSError: No response arrived before the timeout.
    """
    parts, body = urlsplit(url), "" if form is None else urlencode(form)
    head = [f"{'GET' if form is None else 'POST'} {path} HTTP/1.1", f"Host: {parts.netloc}"]
    head += [f"Origin: http://{parts.netloc}", "Connection: close", f"Content-Length: {len(body)}"]
    head += [f"X-Forwarded-For: 10.{number >> 16}.{number >> 8 & 255}.{number & 255}"]
    head += ["Content-Type: application/x-www-form-urlencoded"] + ([f"Cookie: {cookie}"] if cookie else [])
    reader, writer = await asyncio.open_connection(parts.hostname, parts.port)
    try:
        writer.write("\r\n".join([*head, "", body]).encode())
        async with asyncio.timeout(patience):
            top, _, content = (await reader.read(-1)).decode().partition("\r\n\r\n")
    finally:
        writer.close()
    if not top:
        raise ConnectionError("no answer")
    first, *lines = top.split("\r\n")
    headers = {name.lower(): value for name, _, value in (line.partition(": ") for line in lines)}
    return HttpResponse(int(first.split()[1]), headers, content)


async def arrive_at_once(url: str, people: int) -> tuple[Times, list[str]]:
    """Let all participants arrive at once and proceed to their task. Return response times and links."""
    times = Times()

    async def timed(name: str, number: int, path: str, form: Mapping[str, str] | None = None) -> HttpResponse:
        began = time.perf_counter()
        try:
            answer = await asyncio.wait_for(ask(url, path, form, number), PATIENCE)
        except OSError as error:
            times.failed.append(f"{name}: {error!r}")
            raise
        times.pages[name].append(time.perf_counter() - began)
        if answer.status not in (200, 303):
            times.failed.append(f"{name}: {answer.status}")
        return answer

    async def person(number: int) -> str:
        await timed("welcome", number, "/")
        link = (await timed("begin", number, "/begin", {})).headers.get("location", "")
        await timed("consent", number, link)
        await timed("agree", number, link, {"phase": "consent", "agree": "yes"})
        task = await timed("task", number, link)
        if not any(mark in task.body for mark in TASK_PAGES):
            times.failed.append("task: another page")
        return link

    links = await asyncio.gather(*(person(number) for number in range(people)), return_exceptions=True)
    return times, [link for link in links if isinstance(link, str)]
