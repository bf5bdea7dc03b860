"""A detector of objects that are ejected or pass through solid geoms (docs/metrics.md)."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.house.compiled.rays import first_hit, moving_geoms
from mjsim.house.scene.scene import Scene
from mjsim.values.actions import EventKind
from mjsim.world.health.scan import DISPLACED, FAST, OUTSIDE
from mjsim.world.health.settle_times import SettlingObject

# Distance of an object from its anchor at which the path between them is checked, in metres.
CHECK_DISTANCE = 0.02

MAX_FLIGHT = 1.0  # maximum horizontal distance from the point of release, in metres
_MIN_HEIGHT, _MAX_HEIGHT = -0.05, 3.0  # range of heights at which an object is inside the house, in metres


@dataclass(frozen=True, eq=False)
class AnomalyState:
    """The state of an `AnomalyDetector`."""

    anchors: NDArray[np.float64]  # see `AnomalyDetector`
    ejected: tuple[int, ...]  # objects that count as ejected until a hand holds them again
    ejections: int
    tunnellings: int


class AnomalyDetector:
    """A detector that finds and counts objects that are ejected or pass through solid geoms.

    Attributes:
        anchors: Centre of each object when its path was last checked, in metres, shape (n, 3).
        ejections: Number of ejections so far.
        tunnellings: Number of times so far that an object passed through a solid geom.
    """

    def __init__(self, scene: Scene) -> None:
        self._model, self._rooms, self._bodies = scene.model, scene.rooms, scene.index.bodies
        self.anchors = np.zeros((len(self._bodies), 3))

    def reset(self, data: mujoco.MjData) -> None:
        self.move_anchors(data)
        self._ejected: set[int] = set()
        self.ejections = self.tunnellings = 0

    def move_anchors(self, data: mujoco.MjData) -> None:
        """Move the anchors to the current positions of the objects, without checking the paths."""
        self.anchors[:] = data.xipos[self._bodies]

    def find(
        self,
        data: mujoco.MjData,
        flags: NDArray[np.uint8],
        settling: Mapping[int, SettlingObject],
        gripped: Collection[int],
    ) -> list[tuple[EventKind, int]]:
        """Return the ejections and tunnelling in this control step, each with the index of its object."""
        found = []
        self._ejected.difference_update(gripped)
        far = {item for item, release in settling.items() if self._flew_off(data, item, release)}
        for item in np.flatnonzero(flags & (DISPLACED | FAST)).tolist():
            if flags[item] & DISPLACED:
                if self._passed_through(data, item):
                    found.append((EventKind.TUNNELLED, item))
                self.anchors[item] = data.xipos[self._bodies[item]]
                if self._is_outside(item):
                    far.add(item)
            if flags[item] & FAST and item not in gripped:
                far.add(item)
        self.tunnellings += len(found)
        ejected = sorted(far - self._ejected)
        self._ejected.update(ejected)
        self.ejections += len(ejected)
        return found + [(EventKind.EJECTED, item) for item in ejected]

    def get_state(self) -> AnomalyState:
        return AnomalyState(
            self.anchors.copy(), tuple(sorted(self._ejected)), self.ejections, self.tunnellings
        )

    def set_state(self, state: AnomalyState) -> None:
        self.anchors[:] = state.anchors.reshape(self.anchors.shape)
        self._ejected = set(state.ejected)
        self.ejections, self.tunnellings = state.ejections, state.tunnellings

    def _flew_off(self, data: mujoco.MjData, item: int, release: SettlingObject) -> bool:
        x, y = data.xipos[self._bodies[item], :2].tolist()
        return bool(np.hypot(x - release.x, y - release.y) > MAX_FLIGHT)

    def _passed_through(self, data: mujoco.MjData, item: int) -> bool:
        body = int(self._bodies[item])
        start = self.anchors[item]
        path = data.xipos[body] - start
        distance, geom = first_hit(
            self._model, data, start, path, through=moving_geoms(self._model), reach=1.0
        )
        return distance < 1.0 and bool(self._model.geom_contype[geom] or self._model.geom_conaffinity[geom])

    def _is_outside(self, item: int) -> bool:
        x, y, z = self.anchors[item].tolist()
        return not (_MIN_HEIGHT < z < _MAX_HEIGHT and self._rooms.contains((x, y), OUTSIDE))
