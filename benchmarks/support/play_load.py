"""How fast `mjsim play` answers, what a session costs, and whether hours of play leave anything behind."""

import asyncio
import math
import os
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.support.play_browser import Link, SimulatedBrowser, begin_task
from benchmarks.support.play_server import PATIENCE, PlayProcess, memory, processor_time, worker_of

PERIOD = 0.25  # s between two inputs
MOBILE = Link(latency=0.04, jitter=0.01, loss=0.01)
SAMPLES = 12  # of the memory
WARMING_UP = 0.25  # share of the masher's time whose memory does not count


def measure_latency(folder: Path, seconds: float, *words: str) -> dict[str, Any]:
    """From an input to the frame that shows it, frames a second and bandwidth, for codecs and links."""
    cases = {
        "jpeg": ("jpeg", False, Link()),
        "h264": ("h264", False, Link()),
        "state": ("none", True, Link()),
        "h264, slow link": ("h264", False, MOBILE),
    }
    found = {}
    with PlayProcess(folder, "--sessions", "2", *words) as server:
        for name, (codec, state, link) in cases.items():
            found[name] = asyncio.run(_latency(server, seconds, codec, state, link))
    return found


async def _latency(
    server: PlayProcess, seconds: float, codec: str, state: bool, link: Link
) -> dict[str, float]:
    address = server.begin()
    browser = SimulatedBrowser(address, codec=codec, state=state, link=link)
    await _show_something(browser)
    worker = worker_of(server.journal(address, "task"))
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
    await browser.leave()
    return result


def measure_crowd(folder: Path, seconds: float, codec: str, a_core: int, *words: str) -> dict[str, float]:
    """So many sessions for each core at once: frames a second of the slowest, and the answers of all.

    Args:
        folder: Of the visits.
        seconds: How long.
        codec: Of their frames; `none` for states.
        a_core: Sessions for each core.
        words: Further words of the server's command line.
    """
    count = a_core * (os.cpu_count() or 1)
    with PlayProcess(folder, "--sessions", str(count), *words) as server:
        return asyncio.run(_crowd(server, seconds, codec, count))


async def _crowd(server: PlayProcess, seconds: float, codec: str, count: int) -> dict[str, float]:
    browsers = [SimulatedBrowser(server.begin(), codec=codec, state=codec == "none") for _ in range(count)]
    await asyncio.gather(*(_show_something(browser) for browser in browsers))
    trips = await asyncio.gather(*(_turn(browser, seconds) for browser in browsers))
    rates = [len(browser.frames) / seconds for browser in browsers]
    workers = [worker_of(server.journal(browser.address, "task")) for browser in browsers]
    result = {
        **_answers([trip for times in trips for trip in times], rates),
        "sessions": count,
        "memory_mb": float(np.mean([memory(worker) for worker in workers])),
        "width": float(np.median([browser.frames[-1].width for browser in browsers])),
    }
    await asyncio.gather(*(browser.leave() for browser in browsers))
    return result


async def _show_something(browser: SimulatedBrowser) -> None:
    """Start the task of a visit, and wait for frames."""
    await begin_task(browser)
    await browser.until(lambda: bool(browser.frames))
    await asyncio.sleep(1.0)


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


def measure_masher(folder: Path, minutes: float, seed: int, *words: str) -> dict[str, Any]:
    """Press keys at random for so long: memory over time, and whether anything is stuck."""
    with PlayProcess(folder, *words) as server:
        return asyncio.run(_mash(server, 60.0 * minutes, np.random.default_rng(seed)))


async def _mash(server: PlayProcess, seconds: float, rng: np.random.Generator) -> dict[str, Any]:
    address = server.begin()
    browser = SimulatedBrowser(address, codec="jpeg", state=True)
    await browser.open("training")  # it has no limit of time
    await browser.ready()
    worker = worker_of(server.journal(address, "training"))
    memories, began, longest = list[tuple[float, float]](), time.perf_counter(), 0.0
    while (passed := time.perf_counter() - began) < seconds:
        if passed >= len(memories) * seconds / SAMPLES:
            memories.append((memory(worker), memory(server.process.pid)))
        for _ in range(20):
            _mash_once(browser, rng)
            await asyncio.sleep(float(rng.exponential(0.04)))
        sent = time.perf_counter()
        await browser.taken()
        longest = max(longest, time.perf_counter() - sent)
        if "over" in browser.last:
            break
    steady = np.array(memories[max(1, int(WARMING_UP * len(memories))) :])
    return {
        "minutes": (time.perf_counter() - began) / 60.0,
        "inputs": browser.acknowledged,
        "longest_wait_s": longest,
        "worker_mb": [round(first, 1) for first, _ in memories],
        "server_mb": [round(second, 1) for _, second in memories],
        "growth": [float(g) for g in (steady[-1] - steady[0]) / steady[0]] if len(steady) else [0.0, 0.0],
        "frames": len(browser.frames),
        "patience_s": PATIENCE,
    }


def _mash_once(browser: SimulatedBrowser, rng: np.random.Generator) -> None:
    axes = {name: float(rng.choice([-1.0, 0.0, 1.0])) for name in ("forward", "left", "turn", "look")}
    more: dict[str, Any] = {}
    if rng.random() < 0.3:
        more["yaw"] = float(rng.normal(0.0, 1.0))
    if rng.random() < 0.2:
        more["press"] = str(rng.choice(["left hand", "right hand", "act"]))
    if rng.random() < 0.1:
        more["scroll"] = int(rng.integers(-3, 4))
    browser.press(**axes, **more)


def load() -> float:
    """How many processes want to run, for each core."""
    return os.getloadavg()[0] / (os.cpu_count() or 1)
