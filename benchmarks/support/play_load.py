"""Measure the latency of `mjsim play`, the cost of a session, and the number of possible sessions."""

import asyncio
import math
import os
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.support.play_browser import SimulatedBrowser
from benchmarks.support.play_server import (
    TASK_ALONE,
    PlayProcess,
    ProgressReport,
    memory,
    processor_time,
    worker_of,
)
from benchmarks.support.simulated_link import Link
from experiments.record.phases import TASK

PERIOD = 0.25  # time between two inputs in seconds
MOBILE = Link(latency=0.04, jitter=0.01, loss=0.01)
AT_ONCE = 2  # number of sessions that are opened simultaneously
SETTLING = 2.0  # waiting time before a session is measured, in seconds
SETTLING_TOGETHER = 8.0  # time for concurrent sessions to adapt the size of their frames, in seconds
MIN_FPS, MAX_MS = 15.0, 150.0  # required fps, and longest 95th percentile from input to frame in ms
MIN_STATES, MAX_ACKNOWLEDGED = (
    24.5,
    60.0,
)  # for drawing clients: required snapshots per second, and longest 95th percentile of acknowledgements in ms
CASES = {  # codec and link of each case
    "jpeg": ("jpeg", Link()),
    "h264": ("h264", Link()),
    "states": ("none", Link()),
    "states, slow link": ("none", MOBILE),
    "jpeg, slow link": ("jpeg", MOBILE),
    "h264, slow link": ("h264", MOBILE),
}


def measure_latency(folder: Path, seconds: float, report: ProgressReport, *words: str) -> dict[str, Any]:
    """Measure latency from input to frame, fps and bandwidth for each codec and link.

    For a drawing client, measure the time until an input is acknowledged, and snapshots per second.

    Args:
        folder: Folder for the visits.
        seconds: Duration of each case.
        report: Called with progress messages.
        words: Additional command-line arguments of the server.
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
    report: ProgressReport,
    *words: str,
    core: int | None = None,
) -> list[dict[str, float]]:
    """Find how many concurrent sessions keep 15 fps and 150 ms, or 25 snapshots per second and 60 ms.

    Args:
        folder: Folder for the visits, with a subfolder for each number of sessions.
        seconds: Duration for each number of sessions.
        codec: Codec of frames, or `none` for drawing clients.
        counts: Descending numbers of sessions, which are tried until one meets the requirements.
        report: Called with progress messages.
        words: Additional command-line arguments of the server.
        core: The only core that the server may use, or None for all cores.
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
    """Return the median width of the last frames in pixels, or 0 if there are no frames."""
    return float(np.median([browser.frames[-1].width if browser.frames else 0 for browser in browsers]))


async def settle(browsers: Sequence[SimulatedBrowser], seconds: float = SETTLING_TOGETHER) -> None:
    """Start the tasks, and wait until the clocks of the clients and the server agree."""
    opening = asyncio.Semaphore(AT_ONCE)
    await asyncio.gather(*(_show_something(browser, opening) for browser in browsers))
    await asyncio.gather(*(turn(browser, seconds) for browser in browsers))


async def _show_something(browser: SimulatedBrowser, opening: asyncio.Semaphore) -> None:
    async with opening:
        await browser.open(TASK)
        await browser.run()
        await browser.until(lambda: bool(browser.frames))


async def turn(browser: SimulatedBrowser, seconds: float) -> list[float]:
    """Turn left and right. Return the times in ms until inputs appear in a frame or are acknowledged."""
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
    """Return the number of runnable processes per core."""
    return os.getloadavg()[0] / (os.cpu_count() or 1)
