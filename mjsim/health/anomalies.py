"""Objects left to themselves: released ones until they rest, and those that go where nothing should.

`docs/health.md` defines settling, ejection and tunnelling.
"""

from collections.abc import Collection
from dataclasses import dataclass, replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.actions import EventKind
from mjsim.health.scan import FAST, MOVED, OUTSIDE, PUSHED, SLOW
from mjsim.model.rays import first_hit
from mjsim.model.scene import Scene
from mjsim.options import REST_STEPS

MOVED_DISTANCE = 0.02  # m, from where an object was last looked at

FLIGHT = 1.0  # m, horizontally
_LOWEST, _HIGHEST = -0.05, 3.0  # m


@dataclass
class Release:
    """An object between release and rest.

    Attributes:
        time: When a hand last held it, s.
        x: Where its centre was then, m.
        y: Likewise.
        still: For how many control steps in a row it has been at rest.
        since: When it first was, in this row, s.
    """

    time: float
    x: float
    y: float
    still: int = 0
    since: float = 0.0


@dataclass(frozen=True)
class ReleasesState:
    """Released and held objects, as a value.

    Attributes:
        falling: Number and release of each object that has not come to rest.
        gripped: Number of each held object, when it was last seen in the hand, s, and where its centre was, m.
    """

    falling: tuple[tuple[int, Release], ...]
    gripped: tuple[tuple[int, float, list[float]], ...]


class Releases:
    """Objects that a hand has let go of and that have not come to rest since, nor been pushed by the person."""

    def __init__(self, scene: Scene) -> None:
        self._bodies, self._trees = scene.index.bodies, scene.index.trees
        self.reset()

    def reset(self) -> None:
        """No hand holds anything, or has let go of anything."""
        self.falling: dict[int, Release] = {}
        self._gripped: dict[int, tuple[float, list[float]]] = {}  # when and where, last

    @property
    def any(self) -> bool:
        """Whether there is anything to follow."""
        return bool(self.falling or self._gripped)

    def follow(self, data: mujoco.MjData, gripped: Collection[int], marks: NDArray[np.uint8]) -> list[float]:
        """Take note of a control step.

        Args:
            data: The state at its end.
            gripped: Objects that are welded to a hand.
            marks: Marks of each object, (n,).

        Returns:
            Seconds from release to rest, of the objects that have been at rest for `REST_STEPS` steps now.
        """
        for item, (last, (x, y, _)) in self._gripped.items():
            if item not in gripped:
                self.falling[item] = Release(last, x, y)
        time = float(data.time)
        self._gripped = {item: (time, data.xipos[self._bodies[item]].tolist()) for item in gripped}
        settled = []
        for item, release in list(self.falling.items()):
            if item in gripped or marks[item] & PUSHED:
                del self.falling[item]
                continue
            quiet = bool(marks[item] & SLOW) or not data.tree_awake[self._trees[item]]
            if quiet and release.still == 0:
                release.since = time
            release.still = release.still + 1 if quiet else 0
            if release.still == REST_STEPS:
                settled.append(release.since - release.time)
                del self.falling[item]
        return settled

    def get_state(self) -> ReleasesState:
        """Everything, as a value."""
        falling = tuple((item, replace(release)) for item, release in self.falling.items())
        return ReleasesState(falling, tuple((item, *last) for item, last in self._gripped.items()))

    def set_state(self, state: ReleasesState) -> None:
        """Go on from what `get_state` gave."""
        self.falling = {item: replace(release) for item, release in state.falling}
        self._gripped = {item: (time, center) for item, time, center in state.gripped}


@dataclass(frozen=True, eq=False)
class AnomalyState:
    """What an `AnomalyDetector` remembers, as a value.

    Attributes:
        anchors: Where each object's centre was last looked at, m, shape (n, 3).
        ejected: Objects that count as ejected until a hand holds them again.
        ejections: Number so far.
        tunnellings: Number so far.
    """

    anchors: NDArray[np.float64]
    ejected: tuple[int, ...]
    ejections: int
    tunnellings: int


class AnomalyDetector:
    """Ejections and tunnelling of objects.

    Attributes:
        anchors: Where each object's centre was last looked at, m, (n, 3).
        ejections: How many so far.
        tunnellings: How many so far.
    """

    def __init__(self, scene: Scene) -> None:
        self._model, self._rooms, self._bodies = scene.model, scene.rooms, scene.index.bodies
        self.anchors = np.zeros((len(self._bodies), 3))

    def reset(self, data: mujoco.MjData) -> None:
        """Start from the present state."""
        self.anchors[:] = data.xipos[self._bodies]
        self._ejected: set[int] = set()
        self.ejections = self.tunnellings = 0

    def resume(self, data: mujoco.MjData) -> None:
        """Take the objects to have been where they are now."""
        self.anchors[:] = data.xipos[self._bodies]

    def find(
        self, data: mujoco.MjData, marks: NDArray[np.uint8], releases: Releases, gripped: Collection[int]
    ) -> list[tuple[EventKind, int]]:
        """What has escaped in this control step, with the number of the object.

        Args:
            data: The state at its end.
            marks: Marks of each object, (n,).
            releases: Objects that were let go of.
            gripped: Objects that are welded to a hand; what was ejected counts again once it was in a hand.
        """
        found = []
        self._ejected.difference_update(gripped)
        far = {item for item, release in releases.falling.items() if self._flown(data, item, release)}
        for item in np.flatnonzero(marks & (MOVED | FAST)).tolist():
            if marks[item] & MOVED:
                if self._passed_through(data, item):
                    found.append((EventKind.TUNNELLED, item))
                self.anchors[item] = data.xipos[self._bodies[item]]
                if self._outside(item):
                    far.add(item)
            if marks[item] & FAST and item not in gripped:
                far.add(item)
        self.tunnellings += len(found)
        ejected = sorted(far - self._ejected)
        self._ejected.update(ejected)
        self.ejections += len(ejected)
        return found + [(EventKind.EJECTED, item) for item in ejected]

    def get_state(self) -> AnomalyState:
        """Everything, as a value."""
        return AnomalyState(
            self.anchors.copy(), tuple(sorted(self._ejected)), self.ejections, self.tunnellings
        )

    def set_state(self, state: AnomalyState) -> None:
        """Go on from what `get_state` gave."""
        self.anchors[:] = state.anchors.reshape(self.anchors.shape)
        self._ejected = set(state.ejected)
        self.ejections, self.tunnellings = state.ejections, state.tunnellings

    def _flown(self, data: mujoco.MjData, item: int, release: Release) -> bool:
        x, y = data.xipos[self._bodies[item], :2].tolist()
        return bool(np.hypot(x - release.x, y - release.y) > FLIGHT)

    def _passed_through(self, data: mujoco.MjData, item: int) -> bool:
        """Whether something static that collides lies between where the object was and where it is."""
        body = int(self._bodies[item])
        start = self.anchors[item]
        way = data.xipos[body] - start
        distance, geom = first_hit(self._model, data, start, way, ignore=(body,), static_only=True, reach=1.0)
        return distance < 1.0 and bool(self._model.geom_contype[geom] or self._model.geom_conaffinity[geom])

    def _outside(self, item: int) -> bool:
        x, y, z = self.anchors[item].tolist()
        return not (_LOWEST < z < _HIGHEST and self._rooms.contains((x, y), OUTSIDE))
