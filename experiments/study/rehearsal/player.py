"""A simulated player that plays a trial using only the messages that a browser receives."""

import functools
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from experiments.errors import RecordError
from experiments.house import House
from experiments.record.phases import TASK
from experiments.visit.folders import VisitFolders
from experiments.visit.tokens import token_hash
from mjsim.house.compiled.house import MAX_HOUSES
from planner.errors import UnreachableError

STEP = 0.04  # duration of a control step, in seconds
STEPS = 16  # number of control steps per input
NEAR = 0.15  # distance at which a corner of the path counts as reached, in metres
ALIGNED = 0.7  # largest heading error at which the player starts to walk, in radians
SEEN = 0.8  # distance at which a viewpoint counts as visited, in metres
STUCK = 0.05  # A player who moves less than this distance, in metres, in `STUCK_AFTER` inputs is stuck.
STUCK_AFTER = 6
BACKWARDS = 3  # number of inputs for which a stuck player walks backwards
PRESS_GAP = 15  # shortest time between two key presses, in control steps


def homes_in(folders: VisitFolders) -> Callable[[str], House]:
    """Return a function that takes a participant's link and loads the house of this participant's task."""
    load = functools.lru_cache(MAX_HOUSES)(House.load)

    def home(link: str) -> House:
        folder = folders.find(token_hash(link.rpartition("/")[2]))
        if folder is None:
            raise RecordError(f"the visit of {link} has no folder in {folders.path}")
        return load(folder.settings(TASK)["house"])

    return home


class SimulatedPlayer:
    """A simulated player that puts objects away and walks along shortest paths.

    The player walks to the goal on the display, if there is one. Otherwise, it walks to the nearest known
    object or bin. If it knows of none, it searches for objects.
    """

    def __init__(self, house: House, rng: np.random.Generator) -> None:
        self._house, self._rng = house, rng
        self._models: dict[str, str] = {}
        self._places: dict[str, tuple[float, float]] = {}  # last known position of each misplaced object
        self._held: tuple[str | None, str | None] = (None, None)
        self._goal: tuple[float, float] | None = None
        self._reach: Any = None
        self._speeds: Mapping[str, float] = {}
        self._searched: list[tuple[float, float]] = []
        self._trail: list[tuple[float, float]] = []
        self._back = 0
        self._pressed = -PRESS_GAP
        self.state: Mapping[str, Any] | None = None

    @property
    def step(self) -> int:
        return 0 if self.state is None else int(self.state["step"])

    def take(self, message: Mapping[str, Any]) -> None:
        match message["type"]:
            case "scene":
                self._speeds = message["speeds"]
            case "moment":
                self._reach = message["reach"]
            case "markers":
                self._take_markers(message["markers"])
            case "snapshot":
                self._take_snapshot(message)

    def act(self) -> dict[str, Any]:
        """Return the next input without its fields `number` and `step`."""
        state = self.state
        if state is None or state["busy"]:
            return {}
        if self._reach is not None and self.step - self._pressed >= PRESS_GAP:
            self._pressed = self.step
            return {"press": "act"}
        x, y, heading = state["body"][:3]
        if self._is_stuck((x, y)):
            self._back = BACKWARDS
        if self._back:
            self._back -= 1
            sideways = float(self._rng.uniform(-1.0, 1.0))
            return {"forward": -1.0, "left": sideways, "turn": sideways}
        return self._walk((x, y), heading, self._aim((x, y)))

    def _take_markers(self, markers: Any) -> None:
        goals = [m["position"] for m in markers if m["role"] == "goal"]
        self._goal = (goals[0][0], goals[0][1]) if goals else None
        for marker in markers:
            if marker["role"] == "flagpole" and marker["object"] is not None:
                self._places[marker["object"]] = marker["position"][0], marker["position"][1]

    def _take_snapshot(self, state: Mapping[str, Any]) -> None:
        self.state = state
        self._models |= state["models"]
        for name in filter(None, self._held):
            if name not in state["held"]:  # the object has been put away
                self._models.pop(name, None)
                self._places.pop(name, None)
        self._held = (state["held"][0], state["held"][1])
        for name, pose in state["objects"].items():
            if name in self._models and not self._is_tidy(name, pose):
                self._places[name] = pose[0], pose[1]
        for name in filter(None, self._held):
            self._places.pop(name, None)

    def _is_tidy(self, name: str, pose: Any) -> bool:
        center = self._house.receptacles[self._receptacle(name)].center
        return math.dist(pose[:2], center[:2]) < 0.5

    def _receptacle(self, name: str) -> str:
        catalogue = self._house.catalogue
        return catalogue.categories[catalogue.objects[self._models[name]].category].receptacle

    def _aim(self, here: tuple[float, float]) -> tuple[float, float]:
        if self._goal is not None:
            return self._goal
        held = [name for name in self._held if name is not None]
        wanted = [] if all(self._held) else list(self._places.values())
        bins = [self._house.approaches[self._receptacle(name)] for name in held if name in self._models]
        if wanted or bins:
            targets = [(float(p[0]), float(p[1])) for p in (wanted or bins)]
            return min(targets, key=lambda target: math.dist(target, here))
        return self._unseen(here)

    def _unseen(self, here: tuple[float, float]) -> tuple[float, float]:
        places = [(float(x), float(y)) for group in self._house.viewpoints.values() for x, y in group]
        self._searched += [p for p in places if p not in self._searched and math.dist(p, here) < SEEN]
        left = [place for place in places if place not in self._searched]
        if not left:
            self._searched.clear()
            left = [place for place in places if math.dist(place, here) > SEEN]
        return min(left, key=lambda place: math.dist(place, here))

    def _walk(self, here: tuple[float, float], heading: float, aim: tuple[float, float]) -> dict[str, Any]:
        geodesics = self._house.geodesics
        try:
            path = geodesics.shortest_path(here, aim).points.tolist()
        except UnreachableError:
            path = [aim]
        ahead = next((p for p in [*path[1:], aim] if math.dist(p, here) > NEAR), aim)
        gap = math.atan2(ahead[1] - here[1], ahead[0] - here[0]) - heading
        gap = (gap + math.pi) % (2.0 * math.pi) - math.pi
        seconds = STEP * STEPS
        turn = max(-1.0, min(1.0, gap / (self._speeds["turning_speed"] * seconds)))
        forward = 0.0
        if abs(gap) < ALIGNED:
            forward = min(1.0, math.dist(ahead, here) / (self._speeds["walking_speed"] * seconds))
        return {"forward": forward, "turn": turn}

    def _is_stuck(self, here: tuple[float, float]) -> bool:
        self._trail = [*self._trail[-STUCK_AFTER:], here]
        stuck = len(self._trail) > STUCK_AFTER and math.dist(self._trail[0], here) < STUCK
        if stuck:
            self._trail.clear()
        return stuck
