"""Collect what assistance conditions show: the state of the task, labels, pictures, rooms and messages."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from experiments.house import House
from experiments.session.shown_path import PathsToNext
from hud.messages import fade, message
from hud.projection import CameraView
from hud.state import Message, Vec3
from hud.task import Alternative, KnownPlan, PlanAhead, TaskObject, TaskReceptacle, TaskStep, TaskView
from mjsim.values.episode import CAPACITY, Episode
from mjsim.values.observation import ObjectStatus, Observation
from mjsim.values.person_parameters import PersonParameters
from planner.plan import Visit, VisitKind
from planner.regret import Regret
from planner.route import Route

# Minimum display time of a message before the announcement of a new plan replaces it, in seconds
READING_TIME = 2.0
REPLANNED = "replanned"


def task_step(visit: Visit) -> TaskStep:
    return TaskStep(visit.kind.value, visit.object)


class _Shown(NamedTuple):
    key: str
    since: float
    object: str | None = None


@dataclass(frozen=True, eq=False)
class PlanView:
    """The planner's suggestion for one state of the world, computed only if a condition requests it."""

    board: "TaskBoard"
    observation: Observation
    route: Callable[[], Route | None]
    paths: Callable[[Visit], PathsToNext]

    @cached_property
    def steps(self) -> tuple[TaskStep, ...]:
        route = self.route()
        return () if route is None else tuple(task_step(visit) for visit in route.visits)

    @cached_property
    def segment(self) -> NDArray[np.float64] | None:
        visit = self._next
        return None if visit is None else self.paths(visit).segment.points

    @cached_property
    def path(self) -> NDArray[np.float64] | None:
        visit = self._next
        return None if visit is None else self.paths(visit).path.ahead(self.observation.position)

    @cached_property
    def goal(self) -> Vec3 | None:
        visit = self._next
        return None if visit is None else self.board.goal(self.observation, visit)

    @property
    def _next(self) -> Visit | None:
        route = self.route()
        return None if route is None else route.next


class TaskBoard:
    """A description of the task for conditions, with the current message and the completed steps.

    `order` lists the object names in the random order chosen for this participant (PAPER section 5).
    """

    def __init__(
        self,
        house: House,
        episode: Episode,
        order: Sequence[str],
        eye_height: float = PersonParameters.eye_height,
    ) -> None:
        self.house = house
        self.episode = episode
        self._order = tuple(order)
        self._eye_height = eye_height
        self._done: list[TaskStep] = []
        self._scroll = 0
        self._latest = _Shown("started", -math.inf)
        self._replanned_at: float | None = None
        self._objects: dict[int, TaskObject] = {}
        self._receptacles = tuple(self._task_receptacle(key) for key in episode.receptacles)

    def note_visit(self, visit: Visit) -> None:
        self._done.append(task_step(visit))
        self._scroll = 0

    def scroll(self, rows: int) -> None:
        """Scroll the task list by a number of rows, towards its end if positive. The next visit undoes this."""
        max_rows = 2 * len(self.episode.objects)
        self._scroll = min(max(self._scroll + rows, -max_rows), max_rows)

    def show_message(self, key: str, time: float, object_name: str | None = None) -> None:
        """Replace the displayed message. Messages report events and refused actions. `time` is in seconds."""
        shown = self._shown(time)
        if shown.key == REPLANNED and time >= shown.since + READING_TIME:
            self._replanned_at = None
        self._latest = _Shown(key, time, object_name)

    def announce_replan(self, time: float) -> None:
        """Announce the plan that was made at `time` once the current message has been shown long enough."""
        self._replanned_at = time

    def view(
        self,
        observation: Observation,
        *,
        ahead: PlanAhead = KnownPlan(),  # noqa: B008 - immutable
        capacity: int = CAPACITY,
        camera: CameraView | None = None,
        regrets: Callable[[], Mapping[Visit, Regret]] = dict,
    ) -> TaskView:
        """Return the current view of the task for a condition."""
        return TaskView(
            objects=self._task_objects(observation),
            receptacles=self._receptacles,
            order=self._order,
            texts=self.house.texts,
            hands=observation.hands,
            capacity=capacity,
            steps_done=tuple(self._done),
            ahead=ahead,
            position=(float(observation.position[0]), float(observation.position[1])),
            eye=_vec3(observation.eye),
            eye_height=self._eye_height,
            message=self._message(observation.time),
            clock=observation.time,
            camera=camera,
            heading=observation.heading,
            bounds=self.house.bounds,
            scroll=self._scroll,
            alternatives=lambda: tuple(
                Alternative(*task_step(visit), found.regret, found.capped)
                for visit, found in regrets().items()
            ),
        )

    def _message(self, time: float) -> Message | None:
        key, since, name = self._shown(time)
        opacity = fade(time - since)
        if opacity <= 0:
            return None
        if name is None or name not in self.episode.targets:
            return message(key, self.house.texts, opacity=opacity)
        receptacle = self.house.catalogue.receptacles[self.episode.targets[name]]
        return message(
            key,
            self.house.texts,
            object=self._label(name),
            receptacle=receptacle.label,
            opacity=opacity,
        )

    def _shown(self, time: float) -> "_Shown":
        if self._replanned_at is None:
            return self._latest
        since = max(self._replanned_at, self._latest.since + READING_TIME)
        return _Shown(REPLANNED, since) if time >= since else self._latest

    def _label(self, name: str) -> str:
        model = next(o.model for o in self.episode.objects if o.name == name)
        return self.house.catalogue.objects[model].label

    def goal(self, observation: Observation, visit: Visit) -> Vec3:
        """Return the position of the object to pick up, or the centre of the target receptacle, in metres."""
        if visit.kind is VisitKind.PICK:
            return _vec3(observation.object_positions[observation.object_names.index(visit.object)])
        return _vec3(self.house.receptacles[self.episode.targets[visit.object]].center)

    def _task_objects(self, observation: Observation) -> tuple[TaskObject, ...]:
        positions, statuses = observation.object_positions.tolist(), observation.object_status
        for i, (position, status) in enumerate(zip(positions, statuses, strict=True)):
            known = self._objects.get(i)
            if known is None or known.position != tuple(position) or known.status != status.value:
                self._objects[i] = self._task_object(i, _vec3(position), status)
        return tuple(self._objects.values())

    def _task_object(self, i: int, position: Vec3, status: ObjectStatus) -> TaskObject:
        placed = self.episode.objects[i]
        return TaskObject(
            name=placed.name,
            label=self.house.catalogue.objects[placed.model].label,
            picture=f"object:{placed.model}",
            category=placed.category,
            room=self.house.rooms.label(self.house.rooms.room_at(position[:2])),
            position=position,
            status=status.value,
            receptacle=self.episode.targets[placed.name],
        )

    def _task_receptacle(self, key: str) -> TaskReceptacle:
        receptacle = self.house.catalogue.receptacles[key]
        return TaskReceptacle(
            key=key,
            label=receptacle.label,
            place=receptacle.place,
            room=self.house.rooms.label(receptacle.room),
            picture=f"receptacle:{key}",
            position=_vec3(self.house.receptacles[key].center),
        )


def _vec3(values: Sequence[float] | NDArray[np.float64]) -> Vec3:
    return float(values[0]), float(values[1]), float(values[2])
