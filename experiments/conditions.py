"""From the state of the world to what an assistance condition sees: labels, pictures, rooms, messages."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from experiments.house import House
from hud.messages import fade, message
from hud.projection import CameraView
from hud.state import Message
from hud.task import Alternative, StepKind, TaskObject, TaskReceptacle, TaskStep, TaskView
from mjsim.episode import Episode
from mjsim.observation import Observation
from planner.plan import Visit, VisitKind
from planner.regret import Regret

READING_TIME = 2.0  # s that a message is shown before the announcement of a new plan takes its place
REPLANNED = "replanned"

STEP: Mapping[VisitKind, StepKind] = {VisitKind.PICK: "pick", VisitKind.PLACE: "place"}


def alternatives(regrets: Mapping[Visit, Regret]) -> tuple[Alternative, ...]:
    """Regrets of possible next visits in the terms of the conditions."""
    return tuple(
        Alternative(STEP[kind], name, found.regret, found.capped) for (kind, name), found in regrets.items()
    )


class _Said(NamedTuple):
    """A message: its key, since when it is shown, s, and the object that it is about."""

    key: str
    since: float
    object: str | None = None


class TaskBoard:
    """Remembers what was done and said in a session, and words the state of the task for the conditions.

    Args:
        house: The house.
        episode: The disorganized house.
        order: Object names in this participant's random order (PAPER section 5).
    """

    def __init__(self, house: House, episode: Episode, order: Sequence[str]) -> None:
        self._house = house
        self._episode = episode
        self._order = tuple(order)
        self._done: list[TaskStep] = []
        self._latest = _Said("started", -math.inf)
        self._replanned_at: float | None = None
        self._receptacles = tuple(self._task_receptacle(key) for key in episode.receptacles)

    def did(self, kind: StepKind, object_name: str) -> None:
        """Note a feasible visit."""
        self._done.append(TaskStep(kind, object_name))

    def say(self, key: str, time: float, object_name: str | None = None) -> None:
        """Show a message about an event or refusal from `time` s on; it replaces the one before."""
        shown = self._shown(time)
        if shown.key == REPLANNED and time >= shown.since + READING_TIME:
            self._replanned_at = None
        self._latest = _Said(key, time, object_name)

    def announce_replan(self, time: float) -> None:
        """Show that the plan was changed at `time` s, as soon as there was time to read the latest message."""
        self._replanned_at = time

    def view(
        self,
        observation: Observation,
        *,
        plan: Sequence[tuple[StepKind, str]] = (),
        path: NDArray[np.float64] | None = None,
        camera: CameraView | None = None,
        alternatives: Callable[[], tuple[Alternative, ...]] = tuple,
    ) -> TaskView:
        """The task as a condition sees it now.

        Args:
            observation: State of the world.
            plan: Remaining visits in planned order.
            path: Floor points of the way to the next visit, m, shape (k, 2).
            camera: The eye camera.
            alternatives: Gives the visits that are possible next.
        """
        return TaskView(
            objects=tuple(self._task_object(observation, i) for i in range(len(observation.object_names))),
            receptacles=self._receptacles,
            order=self._order,
            hands=observation.hands,
            steps_done=tuple(self._done),
            plan=tuple(TaskStep(kind, name) for kind, name in plan),
            path=path,
            goal=self._goal(observation, *plan[0]) if plan else None,
            position=(float(observation.position[0]), float(observation.position[1])),
            eye=_vec3(observation.eye),
            message=self._message(observation.time),
            clock=observation.time,
            camera=camera,
            heading=observation.heading,
            bounds=self._house.bounds,
            alternatives=alternatives,
        )

    def _message(self, time: float) -> Message | None:
        key, since, name = self._shown(time)
        opacity = fade(time - since)
        if opacity <= 0:
            return None
        if name is None:
            return message(key, opacity=opacity)
        receptacle = self._house.catalogue.receptacles[self._episode.targets[name]]
        return message(key, object=self._label(name), receptacle=receptacle.label, opacity=opacity)

    def _shown(self, time: float) -> "_Said":
        """The message that the bar shows at a time, fresh or faded."""
        if self._replanned_at is None:
            return self._latest
        since = max(self._replanned_at, self._latest.since + READING_TIME)
        return _Said(REPLANNED, since) if time >= since else self._latest

    def _label(self, name: str) -> str:
        model = next(o.model for o in self._episode.objects if o.name == name)
        return self._house.catalogue.objects[model].label

    def _goal(self, observation: Observation, kind: StepKind, name: str) -> tuple[float, float, float]:
        if kind == "pick":
            return _vec3(observation.object_positions[observation.object_names.index(name)])
        return _vec3(self._house.receptacles[self._episode.targets[name]].center)

    def _task_object(self, observation: Observation, i: int) -> TaskObject:
        placed = self._episode.objects[i]
        position = observation.object_positions[i]
        return TaskObject(
            name=placed.name,
            label=self._house.catalogue.objects[placed.model].label,
            picture=f"object:{placed.model}",
            category=placed.category,
            room=self._house.rooms.label(self._house.rooms.room_at(position[:2])),
            position=_vec3(position),
            status=observation.object_status[i].value,
            receptacle=self._episode.targets[placed.name],
        )

    def _task_receptacle(self, key: str) -> TaskReceptacle:
        receptacle = self._house.catalogue.receptacles[key]
        return TaskReceptacle(
            key=key,
            label=receptacle.label,
            place=receptacle.place,
            room=self._house.rooms.label(receptacle.room),
            picture=f"receptacle:{key}",
            position=_vec3(self._house.receptacles[key].center),
        )


def _vec3(values: NDArray[np.float64]) -> tuple[float, float, float]:
    return float(values[0]), float(values[1]), float(values[2])
