"""Faults in sessions of `mjsim play`: does every acknowledged input count once, and does the session go on?"""

import asyncio
import json
import os
import signal
import time
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.support.play_browser import SimulatedBrowser, begin_task
from benchmarks.support.play_server import PlayProcess, Say, fill_disk, parent_of, wait_until_idle, worker_of
from experiments.errors import ExperimentError
from experiments.replaying.replay import replay
from experiments.web.journal import read_journal
from experiments.web.session_journal import decode, lines_of

FAULTS_OF_A_VISIT = 12
LARGEST_SCROLL = 100
TASK = "task"
ALL_KILLED = "all processes killed"  # as with the machine: everything has to be loaded again


class FaultyVisit:
    """A visit that is disturbed again and again. Every input scrolls by its own number of rows, which the log shows.

    Args:
        server: Its server.
        seed: Of what is pressed, and of the faults.

    Attributes:
        times: Fault -> seconds until the session went on.
        problems: What went wrong, in words.
    """

    def __init__(self, server: PlayProcess, seed: int) -> None:
        self._server, self._rng = server, np.random.default_rng(seed)
        self.address = server.begin()
        self._journal = server.journal(self.address, TASK)
        self._browser = SimulatedBrowser(self.address)
        self._rows: dict[int, int] = {}
        self._count = 0
        self.times: dict[str, list[float]] = {}
        self.problems: list[str] = []

    async def play(self, faults: list[str]) -> None:
        """Play while these faults happen, then end the session and check its record."""
        await begin_task(self._browser)
        for name in faults:
            await self._press(int(self._rng.integers(3, 12)))
            began = await FAULTS[name](self)
            ready = await self._browser.ready()
            self.times.setdefault(name, []).append(time.perf_counter() - began)
            if ready["input"] < self._browser.acknowledged:
                self.problems.append(f"{name}: input {self._browser.acknowledged} was lost")
            await self._browser.taken()
        await self._press(3)
        await self._browser.taken()
        await self._browser.leave()
        self._check()

    async def cut(self) -> float:
        """The network is gone."""
        await self._browser.cut()
        return await self._open()

    async def reload(self) -> float:
        """The page is loaded again."""
        await self._browser.close()
        self._browser.reload()
        return await self._open()

    async def second_tab(self) -> float:
        """Another tab takes over."""
        first, second = self._browser, SimulatedBrowser(self.address)
        second.acknowledged = first.acknowledged
        began = time.perf_counter()
        await second.open(TASK)
        await second.until(lambda: "occupied" in second.last)
        second.say(type="takeover")
        await first.until(lambda: "replaced" in first.last)
        await first.close()
        second.acknowledged = max(second.acknowledged, first.acknowledged)
        self._browser = second
        return began

    async def kill_worker(self) -> float:
        """The worker dies."""
        self._browser.last.pop("ready", None)
        return await self._hit_worker(lambda worker: os.kill(worker, signal.SIGKILL))

    async def kill_server(self) -> float:
        """The server dies, and is started again."""
        self._server.kill()
        await self._browser.until(lambda: "closed" in self._browser.last)
        await self._browser.cut()
        return await self._restart()

    async def kill_both(self) -> float:
        """Server and worker die, and the server is started again."""
        return await self._kill_with_server([worker_of(self._journal)])

    async def kill_all(self) -> float:
        """All processes die, as with the machine, and the server is started again."""
        forkserver = parent_of(worker := worker_of(self._journal))
        return await self._kill_with_server([worker, forkserver])

    async def _kill_with_server(self, others: list[int]) -> float:
        self._server.kill()
        for process in others:
            os.kill(process, signal.SIGKILL)
        await self._browser.until(lambda: "closed" in self._browser.last)
        await self._browser.cut()
        return await self._restart()

    async def _restart(self) -> float:
        began = time.perf_counter()
        await asyncio.to_thread(self._server.start)
        await self._open()
        return began

    async def full_disk(self) -> float:
        """The disk is full for a while."""
        room = int(self._rng.integers(0, 2000))
        await self._hit_worker(lambda worker: fill_disk(worker, self._journal, room))
        await self._press(2)
        await self._browser.until(lambda: "failed" in self._browser.last)
        return await self.reload()

    async def _hit_worker(self, hit: Callable[[int], None]) -> float:
        worker = worker_of(self._journal)
        await asyncio.to_thread(wait_until_idle, parent_of(worker))
        began = time.perf_counter()
        hit(worker)
        return began

    async def _open(self) -> float:
        began = time.perf_counter()
        await self._browser.open(TASK)
        return began

    async def _press(self, count: int) -> None:
        for _ in range(count):
            self._count += 1
            rows = 1 + self._count % LARGEST_SCROLL
            values: dict[str, Any] = {"forward": float(self._rng.choice([-1.0, 0.0, 1.0])), "scroll": rows}
            values["yaw"] = float(self._rng.normal(0.0, 0.5))
            if self._rng.random() < 0.2:
                values["press"] = str(self._rng.choice(["act", "left hand", "right hand"]))
            self._rows[self._browser.press(**values)] = rows
            await asyncio.sleep(float(self._rng.exponential(0.03)))

    def _check(self) -> None:
        """Compare what counted with what was sent, and simulate it all again."""
        _, steps, _ = decode(read_journal(self._journal))
        lines = lines_of(steps)
        counted = [event["rows"] for event in map(_event, lines) if event["event"] == "scroll"]
        sent = [self._rows[number] for number in range(1, self._browser.acknowledged + 1)]
        if counted != sent:
            self.problems.append(
                f"{self._journal}: {len(counted)} inputs counted, {len(sent)} were acknowledged"
            )
        try:
            replay(self._server.visit(self.address) / TASK)
        except ExperimentError as error:
            self.problems.append(str(error))


FAULTS: dict[str, Callable[[FaultyVisit], Awaitable[float]]] = {
    "socket cut": FaultyVisit.cut,
    "page loaded again": FaultyVisit.reload,
    "second tab": FaultyVisit.second_tab,
    "worker killed": FaultyVisit.kill_worker,
    "server killed": FaultyVisit.kill_server,
    "server and worker killed": FaultyVisit.kill_both,
    ALL_KILLED: FaultyVisit.kill_all,
    "full disk": FaultyVisit.full_disk,
}


def measure_faults(folder: Path, count: int, seed: int, say: Say, *words: str) -> dict[str, Any]:
    """Disturb visits so many times, every kind about as often as another.

    Args:
        folder: Of the visits.
        count: Of faults.
        seed: Of everything that chance decides.
        say: Takes a line about what is under way.
        words: Further words of the server's command line.
    """
    rng = np.random.default_rng(seed)
    names = [list(FAULTS)[i % len(FAULTS)] for i in rng.permutation(count)]
    times: dict[str, list[float]] = {name: [] for name in FAULTS}
    problems: list[str] = []
    with PlayProcess(folder, *words) as server:
        for first in range(0, count, FAULTS_OF_A_VISIT):
            say(f"fault {first} of {count}")
            visit = FaultyVisit(server, seed + first)
            asyncio.run(visit.play(names[first : first + FAULTS_OF_A_VISIT]))
            problems += visit.problems
            for name, taken in visit.times.items():
                times[name] += taken
    counted = [seconds for name, taken in times.items() if name != ALL_KILLED for seconds in taken]
    return {
        "faults": count,
        "wrong": len(problems),
        "problems": problems,
        "resume_p95_s": float(np.percentile(counted, 95) if counted else 0.0),
        "resume_s": {
            name: [float(np.percentile(taken, share)) for share in (50, 95, 100)]
            for name, taken in times.items()
            if taken
        },
        "tracebacks": server.output.read_text().count("Traceback"),
    }


def _event(line: str) -> dict[str, Any]:
    event: dict[str, Any] = json.loads(line)
    return event
