"""The state of a walk between actions, which includes its progress and backing off from obstacles."""

import math

import numpy as np
from numpy.typing import NDArray

from mjsim.values.actions import IDLE, FollowPath, Move, Pick, Place, StepAction
from mjsim.values.observation import ObjectStatus, Observation
from mjsim.values.person_parameters import PersonParameters
from mjsim.world.walking.path_following import (
    ARRIVED,
    BLOCKED,
    Obstacles,
    Pace,
    Walk,
    plain,
    step_from_python,
)

BACK_OFF = Move(forward=-0.4, left=0.3)
BACK_OFF_TIME = 0.6  # how long a blocked person backs off, in seconds


class Walker:
    """A walker that executes `FollowPath` actions, one after the other.

    A path to another pick or place starts a new walk. Other paths continue the previous walk. `walls` (e, 4)
    are the edges (x, y, x, y), in metres, of the floor that the person may use to walk around objects. If
    there are no edges, the person may use the whole floor.
    """

    def __init__(self, person: PersonParameters, walls: NDArray[np.float64]) -> None:
        self._pace, self._walls = Pace.of(person), walls
        self._status: tuple[ObjectStatus, ...] = ()
        self._is_loose = np.zeros(0, np.bool_)
        self.reset()

    def reset(self) -> None:
        """Forget the current visit and its progress."""
        self._visit: Pick | Place | None = None
        self._back_off_until = -math.inf
        self.progress = np.array([np.inf, 0.0])
        self.blocked = False

    def walk(self, action: FollowPath, seen: Observation) -> Walk | None:
        """Convert an action to a `Walk` for the kernels. Return None while the person backs off.

        A person backs off only on the way to a pick or place. A participant that is blocked elsewhere
        immediately chooses another path.
        """
        if action.then is not None and action.then != self._visit:
            self._visit = action.then
            self.progress[:] = np.inf, seen.time
        if action.then is not None and seen.time < self._back_off_until:
            return None
        goal = float(action.goal[0]), float(action.goal[1])
        faces, obstacles = action.then is not None, self._obstacles(seen)
        return Walk(
            action.points,
            goal,
            action.stop_distance,
            faces,
            action.shown,
            action.tolerance,
            self._pace,
            obstacles,
        )

    def record(self, phase: int, time: float) -> None:
        """Record the phase returned by the first control step of a walk, which started at `time` seconds."""
        self.blocked = phase == BLOCKED
        if self.blocked:
            self._back_off_until = time + BACK_OFF_TIME
            self.progress[:] = np.inf, self._back_off_until

    def step(self, action: FollowPath, seen: Observation) -> StepAction:
        """Compute the next control step of a walk, for callers that step the world themselves."""
        walk = self.walk(action, seen)
        if walk is None:
            return BACK_OFF
        phase, *velocities = step_from_python(
            plain(walk), seen.position, seen.heading, seen.time, self.progress, seen.object_positions, True
        )
        self.record(phase, seen.time)
        return action.then or IDLE if phase == ARRIVED else Move(*velocities)

    def _obstacles(self, seen: Observation) -> Obstacles:
        if seen.object_status != self._status:
            self._status = seen.object_status
            self._is_loose = np.array([s is ObjectStatus.LOOSE for s in seen.object_status], np.bool_)
        name = None if self._visit is None else self._visit.object
        target = seen.object_names.index(name) if name in seen.object_names else -1
        positions = np.ascontiguousarray(seen.object_positions)
        return Obstacles(positions, self._is_loose, target, self._walls)
