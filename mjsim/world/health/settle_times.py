"""A timer for released objects that have not come to rest (docs/metrics.md)."""

from collections.abc import Collection
from dataclasses import dataclass, replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.house.scene.scene import Scene
from mjsim.values.options import REST_STEPS
from mjsim.world.health.scan import PUSHED, SLOW


@dataclass
class SettlingObject:
    """An object that was released and has not yet come to rest."""

    time: float  # time at which a hand last held the object, in seconds
    x: float  # x and y position of the object's centre at that time, in metres
    y: float
    still_steps: int = 0  # number of consecutive control steps in which the object has been slow or asleep
    still_since: float = 0.0  # time at the end of the first of these steps, in seconds


@dataclass(frozen=True)
class SettleTimerState:
    """The state of a `SettleTimer`."""

    # Index and state of each released object that is not yet at rest.
    objects: tuple[tuple[int, SettlingObject], ...]
    # Index of each held object, with the latest time and the latest position (3,) at which it was held.
    gripped: tuple[tuple[int, float, list[float]], ...]


class SettleTimer:
    """A timer that tracks released objects until they rest, are gripped again, or are pushed by a foot."""

    def __init__(self, scene: Scene) -> None:
        self._bodies, self._trees = scene.index.bodies.tolist(), scene.index.trees
        self.reset()

    def reset(self) -> None:
        self.objects: dict[int, SettlingObject] = {}
        # Latest time and position at which a hand held each object.
        self._gripped: dict[int, tuple[float, list[float]]] = {}

    def update(self, data: mujoco.MjData, gripped: Collection[int], flags: NDArray[np.uint8]) -> list[float]:
        """Return the settle times, in seconds, of all objects that came to rest in this control step."""
        if not (gripped or self._gripped or self.objects):
            return []
        for item, (last, (x, y, _)) in self._gripped.items():
            if item not in gripped:
                self.objects[item] = SettlingObject(last, x, y)
        time = float(data.time)
        self._gripped = {item: (time, data.xipos[self._bodies[item]].tolist()) for item in gripped}
        settled = []
        for item, settling in list(self.objects.items()):
            if item in gripped or flags[item] & PUSHED:
                del self.objects[item]
                continue
            still = bool(flags[item] & SLOW) or not data.tree_awake[self._trees[item]]
            if still and settling.still_steps == 0:
                settling.still_since = time
            settling.still_steps = settling.still_steps + 1 if still else 0
            if settling.still_steps == REST_STEPS:
                settled.append(settling.still_since - settling.time)
                del self.objects[item]
        return settled

    def get_state(self) -> SettleTimerState:
        objects = tuple((item, replace(settling)) for item, settling in self.objects.items())
        return SettleTimerState(objects, tuple((item, *last) for item, last in self._gripped.items()))

    def set_state(self, state: SettleTimerState) -> None:
        self.objects = {item: replace(settling) for item, settling in state.objects}
        self._gripped = {item: (time, center) for item, time, center in state.gripped}
