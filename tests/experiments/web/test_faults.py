"""Faults in sessions of a client that draws: every acknowledged input counts once, and the session continues."""

import asyncio
import os
import signal
import time

import numpy as np
import pytest

from benchmarks.play import FAST
from benchmarks.support.play_browser import SimulatedBrowser, begin_task
from benchmarks.support.play_server import PlayProcess, fill_disk, parent_of, resident_memory, worker_of
from experiments.record.phases import TASK
from experiments.record.records import EVENTS, read_events
from experiments.trials.replay.replay import replay

pytestmark = [pytest.mark.slow, pytest.mark.long]
FAULTS_OF_A_VISIT = 12
MAX_ROWS = 100


class FaultyVisit:
    """A visit that is disturbed repeatedly. Every input scrolls by its own number of rows, which the log has."""

    def __init__(self, server, seed):
        self._server, self._rng = server, np.random.default_rng(seed)
        self._browser = SimulatedBrowser(server.begin())
        self._journal = server.journal(self._browser.address, TASK)
        self._rows = {}
        self.times = []

    async def play(self, faults):
        """Play while these faults happen, then end the session and check its record."""
        await begin_task(self._browser)
        for fault in faults:
            await self._press(int(self._rng.integers(3, 12)))
            began = await fault(self)
            number = await self._browser.run()
            self.times.append((fault.__name__, time.perf_counter() - began))
            assert number >= self._browser.acknowledged, f"{fault.__name__} lost an acknowledged input"
            await self._browser.taken()
        self._browser.say(type="blur", away=True)
        await self._press(3)
        await self._browser.taken()
        await self._browser.leave()
        run = self._server.visit(self._browser.address) / TASK
        events = read_events(run / EVENTS)
        counted = [event["rows"] for event in events if event["event"] == "scroll"]
        assert counted == [self._rows[number] for number in range(1, self._browser.acknowledged + 1)]
        assert [event["away"] for event in events if event["event"] == "blur"] == [True]
        assert events[-1]["reason"] == "interrupted"
        assert all(verdict.verified for verdict in replay(run).verdicts)

    async def cut(self):
        await self._browser.cut()
        return await self._open()

    async def cut_amid_a_message(self):
        await self._browser.cut(amid_a_message=True)
        return await self._open()

    async def reload(self):
        await self._browser.close()
        self._browser.reload()
        return await self._open()

    async def kill_worker(self):
        return self._hit_worker(lambda worker: os.kill(worker, signal.SIGKILL))

    async def kill_fork_server(self):
        os.kill(parent_of(worker_of(self._journal)), signal.SIGKILL)
        return await self.kill_worker()

    async def kill_server(self):
        worker = worker_of(self._journal)
        self._server.kill()
        await self._browser.until(lambda: "closed" in self._browser.last)
        await self._browser.cut()
        began = time.perf_counter()
        await asyncio.to_thread(self._server.start)
        await self._open()
        await self._browser.until(lambda: self._browser.phase == "paused")
        assert self._browser.last["state"]["reason"] == "disconnected"
        assert worker_of(self._journal) != worker
        return began

    async def full_disk(self):
        room = int(self._rng.integers(0, 2000))
        self._hit_worker(lambda worker: fill_disk(worker, self._journal, room))
        await self._press(2)
        await self._browser.until(lambda: self._browser.phase == "failed")
        return await self.reload()

    def _hit_worker(self, hit):
        self._browser.last.pop("state", None)
        hit(worker_of(self._journal))
        return time.perf_counter()

    async def _open(self):
        began = time.perf_counter()
        await self._browser.open(TASK)
        return began

    async def _press(self, count):
        for _ in range(count):
            rows = 1 + len(self._rows) % MAX_ROWS
            values = {"forward": float(self._rng.choice([-1.0, 0.0, 1.0])), "scroll": rows}
            values["yaw"] = float(self._rng.normal(0.0, 0.5))
            if self._rng.random() < 0.2:
                values["press"] = str(self._rng.choice(["act", "left hand", "right hand"]))
            self._rows[self._browser.press(**values)] = rows
            await asyncio.sleep(float(self._rng.exponential(0.03)))


FAULTS = (
    FaultyVisit.cut,
    FaultyVisit.cut_amid_a_message,
    FaultyVisit.reload,
    FaultyVisit.kill_worker,
    FaultyVisit.kill_fork_server,
    FaultyVisit.kill_server,
    FaultyVisit.full_disk,
)


@pytest.mark.parametrize("words", [FAST, ()])
def test_faults_lose_and_double_no_acknowledged_input(tmp_path, words):
    count = int(os.environ.get("MJSIM_FAULTS", 2 * len(FAULTS)))
    rng = np.random.default_rng(count)
    faults = [FAULTS[i % len(FAULTS)] for i in rng.permutation(count)]
    times = []
    with PlayProcess(tmp_path / "visits", *words) as server:
        for first in range(0, count, FAULTS_OF_A_VISIT):
            visit = FaultyVisit(server, first)
            asyncio.run(visit.play(faults[first : first + FAULTS_OF_A_VISIT]))
            times += visit.times
    assert server.process.returncode == 128 + signal.SIGTERM, "it has ended, and its workers with it"
    for fault in FAULTS:
        taken = [seconds for name, seconds in times if name == fault.__name__]
        print(f"{fault.__name__}: {np.percentile(taken, 50):.2f} s, 95 %: {np.percentile(taken, 95):.2f} s")
    assert "Traceback" not in server.output.read_text()


def test_keys_at_random_for_minutes_leave_memory_as_it_is(tmp_path):
    asyncio.run(asyncio.wait_for(_press_at_random(tmp_path / "visits", 150.0), 900.0))


async def _press_at_random(folder, seconds):
    """Press keys while, every few seconds, another visit comes and goes."""
    rng = np.random.default_rng(13)
    words = ("--phases", TASK, "--time-limit", "86400", "--sessions", "2", *FAST)
    with PlayProcess(folder, *words) as server:
        browser = SimulatedBrowser(server.begin(), codec="jpeg", size=(320, 240))
        await browser.open(TASK)
        await browser.run()
        processes = (worker_of(server.journal(browser.address, TASK)), server.process.pid)
        memories, began = [], time.perf_counter()
        while time.perf_counter() - began < seconds:
            for _ in range(100):
                axes = {name: float(rng.choice([-1, 0, 1])) for name in ("forward", "left", "turn", "look")}
                hand = str(rng.choice(["left hand", "right hand"]))
                browser.press(**axes, press=hand, scroll=int(rng.integers(-3, 4)))
                await asyncio.sleep(float(rng.exponential(0.05)))
                await browser.until(lambda: browser.pending < 50, 2.0)
            browser.forget()
            other = SimulatedBrowser(server.begin(), codec="jpeg", size=(320, 240))
            await other.open(TASK)
            await other.run()
            await other.leave()
            memories.append([resident_memory(process) for process in processes])
        await browser.close()
    steady = np.array(memories[len(memories) // 3 :])
    assert (steady.max(axis=0) < 1.05 * steady[0]).all(), memories
