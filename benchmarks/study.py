"""Measure a study server over real HTTP and sockets while many participants arrive or play at once."""

import asyncio
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.support.play_browser import SimulatedBrowser
from benchmarks.support.play_load import load, settle, turn
from benchmarks.support.play_server import processor_time
from benchmarks.support.requirements import Requirement, requirement_lines
from benchmarks.support.study_people import arrive_at_once, study_process
from experiments.errors import ConfigError

PEOPLE, SESSIONS = 500, 50
SECONDS, QUICK_SECONDS = 30.0, 5.0  # duration of the sessions in seconds
REQUIREMENTS = {
    "arrivals": (
        Requirement("pages that did not come", "failed", "<=", 0),
        Requirement("slowest page, s", "slowest_s", "<=", 3.0),
    ),
    "sessions": (Requirement("99 % of inputs are safe within, ms", "p99_ms", "<=", 100.0),),
}


def measure(*, parts: Sequence[str] = (), quick: bool = False) -> dict[str, Any]:
    """Run all or some parts of the benchmark and return a JSON-serializable result.

    SQLite is used unless the environment variable MJSIM_STUDY_DATABASE names an empty server database.

    Args:
        parts: Names of the parts to run (all by default).
        quick: True to simulate only a tenth of the participants.

    Raises:
        ConfigError: There is no such part.
    """
    measures = {"arrivals": _arrivals, "sessions": _sessions}
    for name in parts:
        if name not in measures:
            raise ConfigError(f"benchmark study has no part {name!r}; there are {', '.join(measures)}")
    result: dict[str, Any] = {"load": load()}
    with tempfile.TemporaryDirectory(prefix="mjsim-study-") as folder:
        for name in parts or measures:
            print(f"{name}: begins", file=sys.stderr, flush=True)
            result[name] = measures[name](Path(folder) / name, quick)
    return result


def lines(result: Mapping[str, Any]) -> Iterator[str]:
    yield f"load at the start: {result['load']:.1f} processes a core"
    for name, case in result.get("arrivals", {}).get("pages", {}).items():
        yield f"{name}: median {case['median_s']:.2f} s, slowest {case['slowest_s']:.2f} s"
    for name, requirements in REQUIREMENTS.items():
        if name in result:
            found = result[name]
            yield f"{name}: {found['people']} people, {found['processor_s']:.1f} s of a core for the server"
            yield from requirement_lines(found, requirements)


def _arrivals(folder: Path, quick: bool) -> dict[str, Any]:
    people = PEOPLE // 10 if quick else PEOPLE
    with study_process(folder, people=people) as server:
        before = processor_time(server.process.pid)
        times, _ = asyncio.run(arrive_at_once(server.url, people))
        busy = processor_time(server.process.pid) - before
    pages = {
        name: {"median_s": float(np.median(seconds)), "slowest_s": max(seconds)}
        for name, seconds in times.pages.items()
    }
    return {
        "people": people,
        "pages": pages,
        "slowest_s": times.slowest,
        "failed": len(times.failed),
        "processor_s": busy,
    }


def _sessions(folder: Path, quick: bool) -> dict[str, Any]:
    people = SESSIONS // 10 if quick else SESSIONS
    with study_process(
        folder, people=people, sessions=people, fidelity="event" if quick else "full"
    ) as server:
        _, links = asyncio.run(arrive_at_once(server.url, people))
        before = processor_time(server.process.pid)
        addresses = [server.url.rstrip("/") + link for link in links]
        trips = asyncio.run(_play(addresses, QUICK_SECONDS if quick else SECONDS))
        busy = processor_time(server.process.pid) - before
    p50, p99 = np.percentile(trips, (50, 99))
    return {
        "people": len(links),
        "inputs": len(trips),
        "median_ms": float(p50),
        "p99_ms": float(p99),
        "processor_s": busy,
    }


async def _play(addresses: Sequence[str], seconds: float) -> list[float]:
    """Let all participants turn left and right. Return the times until inputs were acknowledged, in ms."""
    browsers = [SimulatedBrowser(address, seed=number) for number, address in enumerate(addresses)]
    await settle(browsers)
    trips = await asyncio.gather(*(turn(browser, seconds) for browser in browsers))
    await asyncio.gather(*(browser.close() for browser in browsers))
    return [trip for times in trips for trip in times]
