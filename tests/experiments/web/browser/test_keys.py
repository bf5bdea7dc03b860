"""A task done in Chromium by key events alone leaves a run that replays to the same metrics."""

import json
import math
import time

import msgspec
import numpy as np
import pytest

from benchmarks.play import FAST
from benchmarks.support.play_server import PATIENCE, PlayProcess
from experiments.house import House
from experiments.record import records
from experiments.record.records import read_events
from experiments.replay.replay import replay
from experiments.trials.setup import trial_episode
from experiments.trials.trial_config import TrialConfig

NEAR = 0.7  # share of the reach from which a pick is tried
ALIGNED = 0.12  # rad off a way on which one walks
MAX_STRETCH = 1.2  # m walked before looking again
TIME_LIMIT = 300.0  # s
HARMLESS = ("KHR_parallel_shader_compile", "GL Driver Message")  # said where there is no graphics card
IN_A_BIN = 0.5  # m from its middle
SETTLED = 30.0  # s within which a few simulated seconds pass


class Watcher:
    """Reads the states that a page gets which draws."""

    def __init__(self, page):
        self.snapshot = None
        self.objects = {}  # name -> where it was seen last
        page.on("websocket", lambda socket: socket.on("framereceived", self._take))

    def _take(self, message):
        if isinstance(message, str) and message.startswith('{"type":"snapshot"'):
            self.snapshot = json.loads(message)
            self.objects |= self.snapshot["objects"]


class KeyPresser:
    """Puts the objects of a task away by keys: the nearest one first, then the bins of what it holds."""

    def __init__(self, page, watcher, house, episode):
        self._page, self._watcher, self._house = page, watcher, house
        self._targets = episode.targets
        self._starts = {placed.name: placed.position for placed in episode.objects}

    def tidy(self):
        until = time.monotonic() + TIME_LIMIT * len(self._targets)
        while not self._page.get_by_role("heading", name="Your result").is_visible():
            assert time.monotonic() < until, "the task was not done in time"
            if self._playing():
                self._visit()
            else:
                self._page.wait_for_timeout(100)

    def _visit(self):
        """Walk on to the next object or bin, or press the key there."""
        held = [name for name in self._watcher.snapshot["held"] if name]
        loose = [name for name in self._targets if name not in held and not self._is_away(name)]
        if held and (len(held) == 2 or not loose):
            key = self._targets[held[0]]
            self._step(self._house.receptacles[key].center[:2], self._house.approaches[key], 0.1)
        elif loose:
            place = min(
                (self._place(name) for name in loose), key=lambda place: math.dist(place, self._position)
            )
            self._step(place, place, NEAR * self._house.person.reach)
        else:
            self._page.wait_for_timeout(100)

    def _place(self, name):
        """Where an object was seen last."""
        return np.array(self._watcher.objects.get(name, self._starts[name])[:2])

    def _is_away(self, name):
        """Whether an object lies in its bin."""
        return (
            math.dist(self._place(name), self._house.receptacles[self._targets[name]].center[:2]) < IN_A_BIN
        )

    def _playing(self):
        """Whether the clock runs; it does not on the next page, which may be there before one looks again."""
        running = self._page.locator("#play[data-phase=running]")
        return self._watcher.snapshot is not None and running.is_visible()

    @property
    def _position(self):
        return np.array(self._watcher.snapshot["eye"][:2])

    def _step(self, goal, stand, near):
        if math.dist(self._position, stand) < near:
            self._turn_to(goal)
            self._page.keyboard.press("e")
            self._settle(2.5)
            return
        path = np.vstack([self._house.geodesics.shortest_path(self._position, stand).points, stand])
        target = next((point for point in path if math.dist(point, self._position) > 0.08), stand)
        self._turn_to(target)
        length = min(MAX_STRETCH, math.dist(target, self._position))
        self._hold("w", length / self._house.person.walking_speed)

    def _turn_to(self, target):
        for _ in range(6):
            ahead = target - self._position
            angle = math.atan2(ahead[1], ahead[0]) - self._watcher.snapshot["eye"][3]
            angle = (angle + math.pi) % (2.0 * math.pi) - math.pi
            if abs(angle) < ALIGNED:
                return
            key = "ArrowLeft" if angle > 0 else "ArrowRight"
            self._hold(key, abs(angle) / self._house.person.turning_speed)

    def _hold(self, key, seconds):
        self._page.keyboard.down(key)
        self._page.wait_for_timeout(1000.0 * seconds)
        self._page.keyboard.up(key)
        self._settle(0.25)

    def _settle(self, seconds):
        """Wait until `seconds` have been simulated."""
        wanted = self._watcher.snapshot["time"] + seconds
        until = time.monotonic() + SETTLED
        while self._watcher.snapshot["time"] < wanted and self._playing() and time.monotonic() < until:
            self._page.wait_for_timeout(20)


@pytest.mark.parametrize(
    ("objects", "assistance"), [(1, "optimal"), pytest.param(6, "none", marks=pytest.mark.slow)]
)
def test_objects_are_put_away_by_keys(tmp_path, chromium, objects, assistance):
    words = ("--objects", str(objects), "--assistance", assistance, *FAST)
    house = House.load()
    episode = trial_episode(TrialConfig(objects=objects, assistance=assistance, seed=0), house)
    page = chromium.new_page(viewport={"width": 640, "height": 480})
    page.set_default_timeout(1000.0 * PATIENCE)
    faults, asked, watcher = [], [], Watcher(page)
    page.on("console", lambda line: faults.append(line.text) if line.type in ("error", "warning") else None)
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("request", lambda request: asked.append(request.url))
    with PlayProcess(tmp_path / "visits", *words) as server:
        page.goto(server.url)
        page.keyboard.press("Enter")  # the button has the focus
        page.wait_for_url("**/play/*")
        page.goto(f"{page.url}?draw=browser")  # however slowly
        page.get_by_role("button", name="Skip the training").press("Enter")
        page.get_by_role("button", name="Start", exact=True).wait_for()
        page.get_by_role("button", name="Start", exact=True).press("Enter")
        page.locator("#list li").first.wait_for(state="attached")
        page.keyboard.press("p")
        page.get_by_role("heading", name="Paused").wait_for()
        page.reload()
        page.get_by_role("button", name="Continue").press("Enter")
        KeyPresser(page, watcher, house, episode).tidy()
        run = server.visit(page.url.partition("?")[0]) / "task"
    assert [fault for fault in faults if not any(words in fault for words in HARMLESS)] == []
    assert all(address.startswith((server.url, "blob:")) for address in asked)
    metrics = msgspec.json.decode((run / records.METRICS).read_bytes())
    assert (metrics["ended"], metrics["delivered"]) == ("all delivered", objects)
    assert all(verdict.verified for verdict in replay(run).verdicts)
    ended = [event for event in read_events(run / "events.jsonl") if event["event"] == "phase_ended"]
    assert [event["phase"] for event in ended] == ["story", "training"]
    assert all(event["duration_s"] > 0.0 for event in ended[:1])
