"""Released objects, until they are at rest; `docs/health.md` defines release, rest and settle time."""

from collections.abc import Collection
from dataclasses import dataclass, replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.health.scan import PUSHED, SLOW
from mjsim.model.scene import Scene
from mjsim.options import REST_STEPS


@dataclass
class SettlingObject:
    """An object between its release and rest.

    Attributes:
        time: When a hand last held it, s.
        x, y: Where its centre was then, m.
        still_steps: Control steps in a row for which it has been slow or asleep.
        still_since: When the first of them ended, s.
    """

    time: float
    x: float
    y: float
    still_steps: int = 0
    still_since: float = 0.0


@dataclass(frozen=True)
class SettleTimerState:
    """What a `SettleTimer` remembers, as a value.

    Attributes:
        objects: Number and state of each released object that is not at rest.
        gripped: Number of each held object, when it was last seen in the hand, s, and where its centre was, m, (3,).
    """

    objects: tuple[tuple[int, SettlingObject], ...]
    gripped: tuple[tuple[int, float, list[float]], ...]


class SettleTimer:
    """Follows objects from their release until they rest, a hand grips them again, or the person's foot pushes them.

    Attributes:
        objects: The released objects that are not at rest, by number.
    """

    def __init__(self, scene: Scene) -> None:
        self._bodies, self._trees = scene.index.bodies.tolist(), scene.index.trees
        self.reset()

    def reset(self) -> None:
        """Start with empty hands and everything at rest."""
        self.objects: dict[int, SettlingObject] = {}
        self._gripped: dict[int, tuple[float, list[float]]] = {}  # when and where, last

    def update(self, data: mujoco.MjData, gripped: Collection[int], flags: NDArray[np.uint8]) -> list[float]:
        """Take a control step into account.

        Args:
            data: The state at its end.
            gripped: Objects that are welded to a hand.
            flags: Flags of each object (`mjsim.health.scan`), shape (n,).

        Returns:
            Settle times, s, of the objects that came to rest with this step.
        """
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
        """Everything, as a value."""
        objects = tuple((item, replace(settling)) for item, settling in self.objects.items())
        return SettleTimerState(objects, tuple((item, *last) for item, last in self._gripped.items()))

    def set_state(self, state: SettleTimerState) -> None:
        """Go on from what `get_state` gave."""
        self.objects = {item: replace(settling) for item, settling in state.objects}
        self._gripped = {item: (time, center) for item, time, center in state.gripped}
