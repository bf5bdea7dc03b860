"""How fast `mjsim play` answers, what a session costs, and how many sessions a machine holds."""

import asyncio
import math
import os
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.support.play_browser import SimulatedBrowser
from benchmarks.support.play_server import TASK_ALONE, PlayProcess, Report, memory, processor_time, worker_of
from benchmarks.support.simulated_link import Link
from experiments.record.phases import TASK

PERIOD = 0.25  # s between two inputs
MOBILE = Link(latency=0.04, jitter=0.01, loss=0.01)
AT_ONCE = 2  # sessions that are opened at the same time
SETTLING = 2.0  # s before a session is measured
SETTLING_TOGETHER = 8.0  # s in which sessions find the size of their frames that leaves room for the others
MIN_FPS, MAX_MS = (
    15.0,
    150.0,
)  # what a session with frames has that holds: frames a second, 95 % from input to frame
MIN_STATES, MAX_ACKNOWLEDGED = (
    24.5,
    60.0,
)  # and one that draws: states a second, 95 % until an input is acknowledged, ms
CASES = {  # codec, link
    "jpeg": ("jpeg", Link()),
    "h264": ("h264", Link()),
    "states": ("none", Link()),
    "states, slow link": ("none", MOBILE),
    "jpeg, slow link": ("jpeg", MOBILE),
    "h264, slow link": ("h264", MOBILE),
}


def measure_latency(folder: Path, seconds: float, report: Report, *words: str) -> dict[str, Any]:
    """From an input to the frame that shows it, frames a second and bandwidth, for codecs and links.

    For a client that draws it is the time until its input is acknowledged, and states a second.

    Args:
        folder: Of the visits.
        seconds: How long for each.
        report: Takes lines about the progress.
        words: Further words of the server's command line.
    """
    found = {}
    with PlayProcess(folder, *TASK_ALONE, "--sessions", "2", *words) as server:
        for name, (codec, link) in CASES.items():
            report(f"{name}, {seconds:.0f} s")
            browser = SimulatedBrowser(server.begin(), codec=codec, link=link)
            found[name] = asyncio.run(_sessions_at_once(server, [browser], seconds, SETTLING))
    return found


def measure_capacity(
    folder: Path,
    seconds: float,
    codec: str,
    counts: Sequence[int],
    report: Report,
    *words: str,
    core: int | None = None,
) -> list[dict[str, float]]:
    """Which numbers of sessions at once hold 15 frames a second and 150 ms, or 25 states a second and 60 ms.

    Args:
        folder: Gets a folder of visits for each number of sessions.
        seconds: How long for each number.
        codec: Of their frames; `none` for clients that draw.
        counts: Numbers of sessions to try, descending, until one holds.
        report: Takes lines about the progress.
        words: Further words of the server's command line.
        core: The only one that the server may use; None for all.
    """
    tried = []
    for count in counts:
        report(f"{count} sessions at once, {codec}, {seconds:.0f} s")
        visits = folder / f"{codec}-{count}"
        with PlayProcess(visits, *TASK_ALONE, "--sessions", str(count), *words, core=core) as server:
            browsers = [SimulatedBrowser(server.begin(), codec=codec) for _ in range(count)]
            tried.append(asyncio.run(_sessions_at_once(server, browsers, seconds, SETTLING_TOGETHER)))
        if tried[-1]["holds"]:
            break
    return tried


async def _sessions_at_once(
    server: PlayProcess, browsers: Sequence[SimulatedBrowser], seconds: float, settling: float
) -> dict[str, float]:
    await settle(browsers, settling)
    workers = [worker_of(server.journal(browser.address, TASK)) for browser in browsers]
    processes = [*workers, server.process.pid, os.getpid()]
    before = [processor_time(pid) for pid in processes]
    began, arrived = time.perf_counter(), [browser.arrived for browser in browsers]
    turns = await asyncio.gather(*(turn(browser, seconds) for browser in browsers))
    trips = [trip for times in turns for trip in times]
    passed = time.perf_counter() - began
    busy = np.subtract([processor_time(pid) for pid in processes], before) / passed
    came = [browser.arrived - before for browser, before in zip(browsers, arrived, strict=True)]
    fps = min(len(browser.frames) for browser in browsers) / passed
    median, p95 = np.percentile(trips, (50, 95)) if trips else (math.inf, math.inf)
    least, most = (MIN_STATES, MAX_ACKNOWLEDGED) if browsers[0].draws else (MIN_FPS, MAX_MS)
    result = {
        "sessions": len(browsers),
        "fps": fps,
        "median_ms": float(median),
        "p95_ms": float(p95),
        "holds": int(fps >= least and p95 <= most),
        "width": median_width(browsers),
        "kbit_s": float(np.mean(came)) * 0.008 / passed,
        "memory_mb": sum(map(memory, (*workers, server.process.pid))) / len(browsers),
        "cores": float(np.mean(busy[: len(browsers)])),
        "server_cores": float(busy[-2]),
        "browser_cores": float(busy[-1]),
    }
    await asyncio.gather(*(browser.close() for browser in browsers))
    return result


def median_width(browsers: Sequence[SimulatedBrowser]) -> float:
    """Width of the last frames, px; 0 where none came."""
    return float(np.median([browser.frames[-1].width if browser.frames else 0 for browser in browsers]))


async def settle(browsers: Sequence[SimulatedBrowser], seconds: float = SETTLING_TOGETHER) -> None:
    """Start the tasks of visits that have no other phase, and let the clocks of pages and server agree."""
    opening = asyncio.Semaphore(AT_ONCE)
    await asyncio.gather(*(_show_something(browser, opening) for browser in browsers))
    await asyncio.gather(*(turn(browser, seconds) for browser in browsers))


async def _show_something(browser: SimulatedBrowser, opening: asyncio.Semaphore) -> None:
    """Start the task of a visit that has no other phase."""
    async with opening:
        await browser.open(TASK)
        await browser.run()
        await browser.until(lambda: bool(browser.frames))


async def turn(browser: SimulatedBrowser, seconds: float) -> list[float]:
    """Turn to and fro; the times from an input to what shows it, ms; where the client draws, to its acknowledgement."""
    browser.forget()
    first, until = browser.next, time.perf_counter() + seconds
    while time.perf_counter() < until:
        browser.press(turn=1.0 if browser.next % 2 else -1.0)
        await asyncio.sleep(PERIOD)
    await browser.taken()
    if browser.draws:
        return [1000.0 * trip for trip in browser.trips]
    frames, trips = iter(browser.frames), list[float]()
    seen = next(frames, None)
    for number in range(first, browser.next):
        while seen is not None and seen.input < number:
            seen = next(frames, None)
        if seen is not None:
            trips.append(1000.0 * (seen.at - browser.sent_at[number]))
    return trips


def load() -> float:
    """How many processes want to run, for each core."""
    return os.getloadavg()[0] / (os.cpu_count() or 1)
