"""Keys pressed at random for an hour: does memory stay, and is anything ever stuck?"""

import asyncio
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.support.play_browser import Link, SimulatedBrowser
from benchmarks.support.play_server import TASK_ALONE, PlayProcess, Say, resident_memory, worker_of
from experiments.runs.phases import TASK

LINK = Link(latency=0.15)  # keeps the rate of frames, and what they cost, at 10 a second
SMALL = (320, 240)  # px; size of the view
NO_LIMIT = ("--time-limit", "86400")  # s
PRESSES = 20  # inputs between two waits for their acknowledgement
PRESS_PERIOD = 0.1  # s between two inputs, on average
SAMPLES = 60  # of the memory
WARMING_UP = 0.1  # share of the time whose memory does not count: buffers and caches fill
VISIT_PERIOD = 60.0  # s after which a further visit comes and goes
STUCK = 30.0  # s without an acknowledgement


def measure_soak(folder: Path, minutes: float, seed: int, say: Say, *words: str) -> dict[str, Any]:
    """Press keys at random in one session for so long, while each minute another visit comes and goes.

    Args:
        folder: Of the visits.
        minutes: How long.
        seed: Of what is pressed.
        say: Takes a line about what is under way.
        words: Further words of the server's command line.
    """
    with PlayProcess(folder, *TASK_ALONE, *NO_LIMIT, "--sessions", "2", *words) as server:
        return asyncio.run(_Soak(server, seed, say).run(60.0 * minutes))


class _Soak:
    """A session of random keys. One that is over, as everything was put away, is followed by another."""

    def __init__(self, server: PlayProcess, seed: int, say: Say) -> None:
        self._server, self._say = server, say
        self._rng = np.random.default_rng(seed)
        self._inputs = self._sessions = self._visits = 0
        self._longest = 0.0

    async def run(self, seconds: float) -> dict[str, Any]:
        """Press keys for so long; what was measured."""
        began, memories = time.perf_counter(), list[tuple[float, float]]()
        self._browser, self._worker = await self._open()
        others = asyncio.create_task(self._other_visits())
        while (passed := time.perf_counter() - began) < seconds and not others.done():
            if passed >= len(memories) * seconds / SAMPLES:
                memories.append((resident_memory(self._worker), resident_memory(self._server.process.pid)))
                self._say(
                    f"{passed / 60.0:.1f} min, worker and server {memories[-1][0]:.0f} and {memories[-1][1]:.1f} MB"
                )
            await self._press_keys()
        others.cancel()
        if others.done() and not others.cancelled() and (error := others.exception()) is not None:
            raise error
        await self._browser.close()
        steady = np.array(memories[max(1, round(WARMING_UP * len(memories))) :])
        growth = steady.max(axis=0) / steady[0] - 1.0 if len(steady) else np.zeros(2)
        return {
            "minutes": (time.perf_counter() - began) / 60.0,
            "inputs": self._inputs + self._browser.acknowledged,
            "sessions": self._sessions,
            "visits": self._visits,
            "longest_wait_s": self._longest,
            "worker_mb": [round(worker, 1) for worker, _ in memories],
            "server_mb": [round(server, 1) for _, server in memories],
            "worker_growth": float(growth[0]),
            "server_growth": float(growth[1]),
        }

    async def _open(self) -> tuple[SimulatedBrowser, int]:
        browser = SimulatedBrowser(self._server.begin(), codec="jpeg", state=True, link=LINK, size=SMALL)
        await browser.open(TASK)
        await browser.ready()
        self._sessions += 1
        return browser, worker_of(self._server.journal(browser.address, TASK))

    async def _press_keys(self) -> None:
        """Press keys for two seconds, and wait until they count; begin anew when all is put away."""
        browser = self._browser
        for _ in range(PRESSES):
            press_at_random(browser, self._rng)
            await asyncio.sleep(float(self._rng.exponential(PRESS_PERIOD)))
        sent = time.perf_counter()
        await browser.until(lambda: browser.acknowledged >= browser.next - 1 or "over" in browser.last, STUCK)
        self._longest = max(self._longest, time.perf_counter() - sent)
        browser.forget()
        if "over" in browser.last:
            self._inputs += browser.acknowledged
            await browser.close()
            self._browser, self._worker = await self._open()

    async def _other_visits(self) -> None:
        while True:
            await asyncio.sleep(VISIT_PERIOD)
            browser = SimulatedBrowser(self._server.begin(), codec="jpeg", size=SMALL)
            await browser.open(TASK)
            await browser.ready()
            for _ in range(PRESSES):
                press_at_random(browser, self._rng)
            await browser.leave()
            self._visits += 1


def press_at_random(browser: SimulatedBrowser, rng: np.random.Generator) -> None:
    """Send an input that holds, turns, scrolls and presses what chance says."""
    values: dict[str, Any] = {
        name: float(rng.choice([-1.0, 0.0, 1.0])) for name in ("forward", "left", "turn", "look")
    }
    if rng.random() < 0.3:
        values["yaw"] = float(rng.normal(0.0, 1.0))
    if rng.random() < 0.2:
        values["press"] = str(rng.choice(["left hand", "right hand", "act"]))
    if rng.random() < 0.1:
        values["scroll"] = int(rng.integers(-3, 4))
    browser.press(**values)
