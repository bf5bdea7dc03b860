"""The assistant, which plans with full knowledge of the house and determines what the HUD shows."""

import functools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from experiments.house import House
from experiments.participants.base import Choice, Guidance
from experiments.record.records import Event, EventLog
from experiments.session.shown_path import TOLERANCE, PathsToNext
from experiments.session.task_board import PlanView, TaskBoard
from experiments.session.task_log import TaskLog
from experiments.session.user_code import is_own, shown_by
from hud.conditions import condition
from hud.markers import BREADCRUMB, GOAL
from hud.projection import CameraView
from hud.state import HudState
from mjsim.values.actions import EventKind, WorldEvent
from mjsim.values.episode import Episode
from mjsim.values.observation import ObjectStatus, Observation
from mjsim.values.options import WorldOptions
from planner.plan import Visit, VisitKind
from planner.route import XY, TaskState
from planner.service import Planner

PLAN_ROLES = frozenset({BREADCRUMB, GOAL})
WORLD_EVENTS = {kind.value: kind for kind in EventKind}
VISIT_KIND = {EventKind.PICKED: VisitKind.PICK, EventKind.PLACED: VisitKind.PLACE}


class Assistant:
    """An assistant that passes task states to the planner and plans to the assistance condition.

    Attributes:
        board: The task list and the messages that the HUD shows.
        shown_roles: Roles of the markers that the condition shows at the start of the task.
        shows_plan: True if the condition shows the plan or its next step.
        is_custom: True if the condition is user code.
    """

    def __init__(
        self,
        board: TaskBoard,
        *,
        assistance: str,
        planner: Planner,
        log: EventLog,
        log_regrets: bool = False,
        options: WorldOptions | None = None,
    ) -> None:
        self.board, self._house, self._episode = board, board.house, board.episode
        self._assistance, self._show = assistance, condition(assistance)
        self._capacity = (options or WorldOptions()).capacity
        self._planner = planner
        self._log = TaskLog(
            planner, log, board.house, board.episode, capacity=self._capacity, regrets=log_regrets
        )
        self._deliveries = deliveries(self._house, self._episode)
        self._paths = PathsToNext(self._house.geodesics)
        self._path_from: Observation | None = None
        self.shown_roles: frozenset[str] = frozenset()
        self.shows_plan = self._rerouted = False
        self.is_custom = is_own(self._show)

    def begin(self, observation: Observation) -> None:
        self._last_visit_at = observation.position.copy()
        self._plan(observation)
        self.board.show_message("started", observation.time)
        state = self.hud_state(observation)
        self.shown_roles = frozenset(marker.role for marker in state.markers)
        self._rerouted = state.rerouted
        numbered = any(item.number is not None for item in state.checklist)
        self.shows_plan = numbered or not self.shown_roles.isdisjoint(PLAN_ROLES)

    def observe(self, observation: Observation, events: Sequence[WorldEvent]) -> None:
        """Process the last control step and its events, and make a new plan if necessary."""
        for event in events:
            if event.kind in VISIT_KIND:
                made = Visit(VISIT_KIND[event.kind], event.object)
                self._last_visit_at = observation.position.copy()
                self._log.visit(event.time, made, self._last_visit_at)
                self.board.note_visit(made)
            self.board.show_message(event.kind.value, observation.time, event.object)
        if events:
            self._plan(observation)
            return
        if self.expecting and self._log.improve(observation.time, self.task_state(observation)):
            self._path_from = observation
        if (places := self._places_to_follow(observation)) is not None:
            self._paths.follow(observation.position, *places)

    @property
    def expecting(self) -> bool:
        """True if a better plan may arrive at any time. The assistant then observes every control step."""
        return self._planner.pending

    def observe_walk(self, positions: NDArray[np.float64], observation: Observation) -> None:
        """Process a walk without events. The result is the same as calling `observe` at every step.

        Args:
            positions: Position of the person in metres after every control step, shape (n, 2).
            observation: State after the last step.
        """
        if (places := self._places_to_follow(observation)) is not None:
            self._paths.path.follow(positions, *places)

    def observe_recorded(self, observation: Observation, events: Sequence[Event]) -> None:
        """Observe the state after a recorded control step, and the events logged during the step."""
        for event in events:
            if event["event"] == "attempt" and event["refusal"] is not None:
                self.board.show_message(event["refusal"], observation.time, event["object"])
        happened = [
            WorldEvent(float(e["t"]), WORLD_EVENTS[e["event"]], e["object"], e["receptacle"])
            for e in events
            if e["event"] in WORLD_EVENTS
        ]
        self.observe(observation, happened)
        for event in events:
            if event["event"] == "scroll":
                self.board.scroll(int(event["rows"]))

    def hud_state(self, observation: Observation, camera: CameraView | None = None) -> HudState:
        """Return the current HUD state.

        If the eye camera `camera` is given, conditions can point to a goal that is out of view.
        """
        view = self.board.view(
            observation,
            ahead=PlanView(self.board, observation, lambda: self._planner.route, self._paths_to),
            capacity=self._capacity,
            camera=camera,
            regrets=functools.partial(self._planner.regrets, shown=True),
        )
        return shown_by(self._show, self._assistance, view)

    def guidance(self, observation: Observation) -> Guidance | None:
        """Return the step and the path that the breadcrumbs mark, or None if there is nothing to show."""
        if BREADCRUMB not in self.shown_roles or (visit := self._planner.next) is None:
            return None
        paths = self._paths_to(visit)
        shown = paths.path if self._rerouted else paths.segment
        return Guidance(visit, shown.points, self._goal(observation, visit), TOLERANCE)

    def choices(self, observation: Observation) -> tuple[Choice, ...]:
        """Return the possible next visits, best first, or an empty tuple if their regrets are not ready."""
        return tuple(
            Choice(
                visit,
                self._goal(observation, visit),
                found.regret,
                found.capped,
                functools.partial(self._planner.regret, visit),
            )
            for visit, found in self._planner.regrets().items()
        )

    def finish(self, time: float) -> None:
        """Log the regrets that had not been computed yet when the visits were logged."""
        self._log.finish(time)

    def task_state(self, observation: Observation) -> TaskState:
        positions = zip(observation.object_names, observation.object_positions, strict=True)
        loose = observation.names_with(ObjectStatus.LOOSE)
        return TaskState(
            position=_xy(observation.position),
            loose={
                name: _xy(self._house.place_of(position[:2])) for name, position in positions if name in loose
            },
            carried=observation.carried,
            deliveries=self._deliveries,
        )

    def _plan(self, observation: Observation) -> None:
        before = self._planner.replans if self.shows_plan else 0
        self._log.plan(
            observation.time, self.task_state(observation), self._last_visit_at, shown=self.shows_plan
        )
        self._path_from = observation
        if self.shows_plan and self._planner.replans > before:
            self.board.announce_replan(observation.time)

    def _paths_to(self, visit: Visit) -> PathsToNext:
        if self._path_from is not None:
            start, self._path_from = self._path_from, None
            self._paths.begin(self._last_visit_at, start.position, *self._places(start, visit))
        return self._paths

    def _places_to_follow(
        self, observation: Observation
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        if self._path_from is not None or (visit := self._planner.next) is None:
            return None
        return self._places(observation, visit)

    def _goal(self, observation: Observation, visit: Visit) -> NDArray[np.float64]:
        return np.array(self.board.goal(observation, visit)[:2])

    def _places(
        self, observation: Observation, visit: Visit
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        goal = self._goal(observation, visit)
        if visit.kind is VisitKind.PICK:
            return self._house.place_of(goal), goal
        return self._house.receptacles[self._episode.targets[visit.object]].approach[:2], goal


def deliveries(house: House, episode: Episode) -> dict[str, XY]:
    """Return the positions in metres where a person stands to deliver the objects, by object name."""
    return {name: _xy(house.receptacles[key].approach) for name, key in episode.targets.items()}


def _xy(point: NDArray[np.float64]) -> XY:
    return float(point[0]), float(point[1])
