"""How fast `mjsim play` answers, what a session costs, and how many sessions a machine holds."""

import asyncio
import math
import os
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.support.play_browser import Link, SimulatedBrowser
from benchmarks.support.play_server import TASK_ALONE, PlayProcess, Say, memory, processor_time, worker_of
from experiments.runs.phases import TASK

PERIOD = 0.25  # s between two inputs
MOBILE = Link(latency=0.04, jitter=0.01, loss=0.01)
SETTLING = 2.0  # s before a session is measured
SETTLING_TOGETHER = 8.0  # s in which sessions find the size of their frames that leaves room for the others
LEAST_FPS, MOST_MS = 15.0, 150.0  # what a session that holds has: frames a second, 95 % from input to frame
CASES = {  # codec, states, link
    "jpeg": ("jpeg", False, Link()),
    "h264": ("h264", False, Link()),
    "state": ("none", True, Link()),
    "jpeg, slow link": ("jpeg", False, MOBILE),
    "h264, slow link": ("h264", False, MOBILE),
}


def measure_latency(folder: Path, seconds: float, say: Say, *words: str) -> dict[str, Any]:
    """From an input to the frame that shows it, frames a second and bandwidth, for codecs and links.

    Args:
        folder: Of the visits.
        seconds: How long for each.
        say: Takes a line about what is under way.
        words: Further words of the server's command line.
    """
    found = {}
    with PlayProcess(folder, *TASK_ALONE, "--sessions", "2", *words) as server:
        server.wait_until_warm()
        for name, case in CASES.items():
            say(f"{name}, {seconds:.0f} s")
            found[name] = asyncio.run(_latency(server, seconds, *case))
    return found


async def _latency(
    server: PlayProcess, seconds: float, codec: str, state: bool, link: Link
) -> dict[str, float]:
    address = server.begin()
    browser = SimulatedBrowser(address, codec=codec, state=state, link=link)
    await _show_something(browser, SETTLING)
    worker = worker_of(server.journal(address, TASK))
    before = [processor_time(pid) for pid in (worker, server.process.pid)]
    browser.bytes, began = 0, time.perf_counter()
    trips = await _turn(browser, seconds)
    passed = time.perf_counter() - began
    busy = [processor_time(pid) for pid in (worker, server.process.pid)]
    result = {
        **_answers(trips, [len(browser.frames) / passed]),
        "width": browser.frames[-1].width,
        "kbit_s": 0.008 * browser.bytes / passed,
        "memory_mb": memory(worker),
        "cores": (busy[0] - before[0]) / passed,
        "server_cores": (busy[1] - before[1]) / passed,
    }
    await browser.close()
    return result


def measure_capacity(
    folder: Path, seconds: float, codec: str, counts: Sequence[int], say: Say, *words: str
) -> dict[str, Any]:
    """How many sessions at once hold 15 frames a second and 150 ms.

    Args:
        folder: Gets a folder of visits for each number of sessions.
        seconds: How long for each number.
        codec: Of their frames; `none` for states.
        counts: Numbers of sessions to try, descending, until one holds.
        say: Takes a line about what is under way.
        words: Further words of the server's command line.
    """
    tried = []
    for count in counts:
        say(f"{count} sessions at once, {codec}, {seconds:.0f} s")
        with PlayProcess(
            folder / f"{codec}-{count}", *TASK_ALONE, "--sessions", str(count), *words
        ) as server:
            server.wait_until_warm()
            tried.append(asyncio.run(_sessions_at_once(server, seconds, codec, count)))
        if tried[-1]["holds"]:
            break
    held = tried[-1]["sessions"] if tried[-1]["holds"] else 0
    return {"tried": tried, "a_core": held / (os.cpu_count() or 1)}


async def _sessions_at_once(server: PlayProcess, seconds: float, codec: str, count: int) -> dict[str, float]:
    browsers = [SimulatedBrowser(server.begin(), codec=codec, state=codec == "none") for _ in range(count)]
    await asyncio.gather(*(_show_something(browser, SETTLING_TOGETHER) for browser in browsers))
    workers = [worker_of(server.journal(browser.address, TASK)) for browser in browsers]
    processes = [*workers, server.process.pid, os.getpid()]
    before = [processor_time(pid) for pid in processes]
    trips = await asyncio.gather(*(_turn(browser, seconds) for browser in browsers))
    rates = [len(browser.frames) / seconds for browser in browsers]
    busy = np.subtract([processor_time(pid) for pid in processes], before) / seconds
    answers = _answers([trip for times in trips for trip in times], rates)
    result = {
        **answers,
        "holds": int(answers["fps"] >= LEAST_FPS and answers["p95_ms"] <= MOST_MS),
        "sessions": count,
        "memory_mb": float(np.mean([memory(worker) for worker in workers])),
        "width": float(np.median([browser.frames[-1].width for browser in browsers])),
        "cores": float(np.mean(busy[:count])),
        "server_cores": float(busy[-2]),
        "browser_cores": float(busy[-1]),
    }
    await asyncio.gather(*(browser.close() for browser in browsers))
    return result


async def _show_something(browser: SimulatedBrowser, settling: float) -> None:
    """Start the task of a visit that has no other phase, and turn until the size of its frames is found."""
    await browser.open(TASK)
    await browser.ready()
    await browser.until(lambda: bool(browser.frames))
    await _turn(browser, settling)


async def _turn(browser: SimulatedBrowser, seconds: float) -> list[float]:
    """Turn to and fro; the times from an input to what shows it, ms."""
    browser.frames.clear()
    first, until = browser.next, time.perf_counter() + seconds
    while time.perf_counter() < until:
        browser.press(turn=1.0 if browser.next % 2 else -1.0)
        await asyncio.sleep(PERIOD)
    await browser.taken()
    frames, trips = iter(browser.frames), list[float]()
    seen = next(frames, None)
    for number in range(first, browser.next):
        while seen is not None and seen.input < number:
            seen = next(frames, None)
        if seen is not None:
            trips.append(1000.0 * (seen.at - browser.sent_at[number]))
    return trips


def _answers(trips: list[float], rates: list[float]) -> dict[str, float]:
    return {
        "fps": min(rates),
        "p95_ms": float(np.percentile(trips, 95)) if trips else math.inf,
        "median_ms": float(np.median(trips)) if trips else math.inf,
    }


def load() -> float:
    """How many processes want to run, for each core."""
    return os.getloadavg()[0] / (os.cpu_count() or 1)
