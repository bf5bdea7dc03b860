"""Plays a task in a real browser by key events alone; what the person would see is read from the journal."""

import math
import struct
import time
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from benchmarks.support.play_server import PATIENCE, PlayProcess
from experiments.house import House
from experiments.web.journal import MAGIC
from experiments.web.session_journal import Opened, Step
from mjsim.episode import Episode

CHROMIUM = Path("/usr/bin/chromium")
NEAR = 0.7  # share of the reach from which a pick or place is tried
ALIGNED = 0.12  # rad off a way on which one walks
STRETCH = 1.2  # m walked before looking again
HEAD = struct.Struct("<II")
LOOSE, CARRIED = 0, 1


class Watcher:
    """Reads a journal as it grows.

    Args:
        path: The journal.
    """

    def __init__(self, path: Path) -> None:
        self._path, self._place = path, len(MAGIC)
        self._decoder: msgspec.msgpack.Decoder[Any] = msgspec.msgpack.Decoder(Opened | Step)
        self.episode: Episode | None = None
        self.step, self.row = 0, dict[str, bytes]()

    def read(self) -> None:
        """Take in what is new."""
        with self._path.open("rb") as file:
            file.seek(self._place)
            content = file.read()
        at = 0
        while at + HEAD.size <= len(content):
            length, _ = HEAD.unpack_from(content, at)
            if at + HEAD.size + length > len(content):
                break
            self._take(content[at + HEAD.size : at + HEAD.size + length])
            at += HEAD.size + length
        self._place += at

    def number(self, name: str) -> float:
        """A value of the latest row."""
        return float(np.frombuffer(self.row[name])[0])

    def array(self, name: str, kind: Any = np.float64) -> NDArray[Any]:
        """An array of the latest row."""
        return np.frombuffer(self.row[name], kind)

    def _take(self, record: bytes) -> None:
        try:
            entry = self._decoder.decode(record)
        except msgspec.ValidationError:
            return  # the last entry
        if isinstance(entry, Opened):
            self.episode = Episode.from_json(entry.episode)
        else:
            self.step, self.row = self.step + 1, entry.row


class KeyPresser:
    """Tidies by keys: turns and walks in stretches, and looks in between.

    Args:
        page: Of the browser, with the task under way.
        watcher: Of its journal.
        house: As a person knows it.
    """

    def __init__(self, page: Any, watcher: Watcher, house: House) -> None:
        self._page, self._watcher, self._house = page, watcher, house

    def tidy(self, seconds: float) -> None:
        """Do the task.

        Raises:
            TimeoutError: It takes longer.
        """
        until = time.monotonic() + seconds
        while not self._over():
            if time.monotonic() > until:
                raise TimeoutError(f"the task was not done within {seconds:.0f} s")
            goal, stand, reach = self._goal()
            if math.dist(self._position, goal) < reach or math.dist(self._position, stand) < 0.1:
                self._turn_to(goal)
                self._page.keyboard.press("e")
                self._settle(2.5)
            else:
                self._walk_towards(stand)

    @property
    def _position(self) -> NDArray[np.float64]:
        position: NDArray[np.float64] = self._watcher.array("position")
        return position

    def _over(self) -> bool:
        return "over" in self._page.url or self._page.evaluate(
            "document.getElementById('panel-title')?.textContent === 'Done' || !document.getElementById('play')"
        )

    def _goal(self) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
        """Where the next object or bin is, where to stand for it, m, and from how far to try, m."""
        self._watcher.read()
        episode, house = self._watcher.episode, self._house
        if episode is None:
            raise ValueError("the journal has no episode yet")
        status = self._watcher.array("object_status", np.int8)
        carried = np.flatnonzero(status == CARRIED)
        if len(carried):
            key = episode.targets[episode.objects[carried[0]].name]
            return house.receptacles[key].center[:2], house.approaches[key], 0.0
        loose = self._watcher.array("object_position").reshape(-1, 3)[status == LOOSE, :2]
        if not len(loose):
            return self._position, self._position, 0.0
        nearest = min(loose, key=lambda place: math.dist(place, self._position))
        return nearest, nearest, NEAR * house.person.reach

    def _walk_towards(self, stand: NDArray[np.float64]) -> None:
        path = self._house.geodesics.shortest_path(self._position, stand).points
        path = np.vstack([path, stand])
        target = next((point for point in path if math.dist(point, self._position) > 0.08), stand)
        self._turn_to(target)
        length = min(STRETCH, math.dist(target, self._position))
        self._hold("w", length / self._house.person.walking_speed)

    def _turn_to(self, target: NDArray[np.float64]) -> None:
        for _ in range(6):
            ahead = target - self._position
            angle = math.atan2(ahead[1], ahead[0]) - self._watcher.number("heading")
            angle = (angle + math.pi) % (2.0 * math.pi) - math.pi
            if abs(angle) < ALIGNED:
                return
            self._hold(
                "ArrowLeft" if angle > 0 else "ArrowRight", abs(angle) / self._house.person.turning_speed
            )

    def _hold(self, key: str, seconds: float) -> None:
        self._page.keyboard.down(key)
        self._page.wait_for_timeout(1000.0 * seconds)
        self._page.keyboard.up(key)
        self._settle(0.25)

    def _settle(self, seconds: float) -> None:
        """Wait until so much time has been simulated."""
        self._watcher.read()
        wanted, until = self._watcher.number("time") + seconds, time.monotonic() + PATIENCE
        while self._watcher.number("time") < wanted and time.monotonic() < until and not self._over():
            self._page.wait_for_timeout(20)
            self._watcher.read()


def play_by_keys(page: Any, server: PlayProcess, house: House, seconds: float) -> Path:
    """Go through a visit in a page that is empty yet, by keys; the run directory of its task.

    Raises:
        TimeoutError: The task takes longer.
    """
    page.set_default_timeout(1000.0 * PATIENCE)
    page.goto(server.url)
    page.get_by_role("button", name="Begin").press("Enter")
    page.wait_for_url("**/play/*")
    address = page.url
    page.get_by_role("button", name="Skip it").press("Enter")
    page.get_by_role("button", name="Start", exact=True).press("Enter")
    watcher, until = Watcher(server.journal(address, "task")), time.monotonic() + PATIENCE
    while not watcher.row and time.monotonic() < until:
        page.wait_for_timeout(50)
        watcher.read()
    KeyPresser(page, watcher, house).tidy(seconds)
    page.get_by_role("heading", name="Your result").wait_for()
    return server.visit(address) / "task"
