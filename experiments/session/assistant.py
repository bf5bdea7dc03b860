"""The assistant: sees the whole house, plans, and says what the HUD shows."""

import functools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from experiments.house import House
from experiments.participants.base import Choice, Guidance
from experiments.record.records import EventLog
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
VISIT_KIND = {EventKind.PICKED: VisitKind.PICK, EventKind.PLACED: VisitKind.PLACE}


class Assistant:
    """Tells the planner about the state of the task, and the condition about the plan.

    Args:
        board: Describes the task to the condition.
        assistance: Name of the assistance condition.
        planner: Answers what to do next.
        log: Where plans and visits are logged.
        log_regrets: Whether the regret of every visit is logged.
        options: Rules of the world, for how much a person carries.

    Attributes:
        shown_roles: Roles of the markers that the condition shows at the start of the task.
        shows_plan: Whether the condition shows the plan or where it leads next.
        shows_own: Whether the condition is a user's own.
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
        self._board, self._house, self._episode = board, board.house, board.episode
        self._assistance, self._show = assistance, condition(assistance)
        self._capacity = (options or WorldOptions()).capacity
        self._planner = planner
        self._log = TaskLog(
            planner, log, board.house, board.episode, capacity=self._capacity, regrets=log_regrets
        )
        self._deliveries = deliveries(self._house, self._episode)
        self._paths = PathsToNext(self._house.geodesics)
        self._path_from: Observation | None = None  # where the paths to the next visit will start
        self.shown_roles: frozenset[str] = frozenset()
        self.shows_plan = self._rerouted = False
        self.shows_own = is_own(self._show)

    def begin(self, observation: Observation) -> None:
        """Plan for the start of the task."""
        self._last_visit_at = observation.position.copy()
        self._plan(observation)
        self.show_message("started", observation.time)
        state = self.hud_state(observation)
        self.shown_roles = frozenset(marker.role for marker in state.markers)
        self._rerouted = state.rerouted
        numbered = any(item.number is not None for item in state.checklist)
        self.shows_plan = numbered or not self.shown_roles.isdisjoint(PLAN_ROLES)
        if self.shows_plan:
            self._planner.settle()

    def observe(self, observation: Observation, events: Sequence[WorldEvent]) -> None:
        """Take note of the last control step and its events; replan where the person left the plan."""
        for event in events:
            if event.kind in VISIT_KIND:
                made = Visit(VISIT_KIND[event.kind], event.object)
                self._last_visit_at = observation.position.copy()
                self._log.visit(event.time, made, self._last_visit_at)
                self._board.note_visit(made)
            self.show_message(event.kind.value, observation.time, event.object)
        if events:
            self._plan(observation)
            return
        if self.expecting and self._log.improve(observation.time, self.task_state(observation)):
            self._path_from = observation
        if (places := self._places_to_follow(observation)) is not None:
            self._paths.follow(observation.position, *places)

    @property
    def expecting(self) -> bool:
        """Whether a better plan may turn up at any moment, so that every control step has to be observed."""
        return self._planner.pending

    def observe_walk(self, positions: NDArray[np.float64], observation: Observation) -> None:
        """Take note of a walk without events in which nothing moved, as `observe` of each step would.

        Args:
            positions: Where the person was after every control step, m, shape (n, 2).
            observation: State at the end.
        """
        if (places := self._places_to_follow(observation)) is not None:
            self._paths.path.follow(positions, *places)

    def show_message(self, key: str, time: float, object_name: str | None = None) -> None:
        """Put a message about an event or a refusal into the message bar."""
        self._board.show_message(key, time, object_name)

    def scroll(self, rows: int) -> None:
        """Scroll the task list by a number of rows, positive towards its end."""
        self._board.scroll(rows)

    def hud_state(self, observation: Observation, camera: CameraView | None = None) -> HudState:
        """What the HUD shows now; a condition needs the eye camera to point to a goal out of view."""
        view = self._board.view(
            observation,
            ahead=PlanView(self._board, observation, lambda: self._planner.route, self._paths_to),
            capacity=self._capacity,
            camera=camera,
            regrets=self._planner.regrets,
        )
        return shown_by(self._show, self._assistance, view)

    def guidance(self, observation: Observation) -> Guidance | None:
        """The next step and the path that the breadcrumbs mark; None where there are none, or when all is done."""
        if BREADCRUMB not in self.shown_roles or (visit := self._planner.next) is None:
            return None
        paths = self._paths_to(visit)
        shown = paths.path if self._rerouted else paths.segment
        return Guidance(visit, shown.points, self._goal(observation, visit), TOLERANCE)

    def choices(self, observation: Observation) -> tuple[Choice, ...]:
        """What can be done next and what it costs compared with the best, the best first; empty until it is known."""
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
        """The task is over: log the regrets of visits that were not known in time."""
        self._log.finish(time)

    def task_state(self, observation: Observation) -> TaskState:
        """The task in the planner's terms."""
        positions = zip(observation.object_names, observation.object_positions, strict=True)
        loose = observation.names_with(ObjectStatus.LOOSE)
        return TaskState(
            position=_xy(observation.position),
            loose={name: _xy(position) for name, position in positions if name in loose},
            carried=observation.carried,
            deliveries=self._deliveries,
        )

    def _plan(self, observation: Observation) -> None:
        """Follow the plan, or make a new one where the task is no longer as planned."""
        before = self._planner.replans if self.shows_plan else 0
        self._log.plan(
            observation.time, self.task_state(observation), self._last_visit_at, shown=self.shows_plan
        )
        self._path_from = observation
        if self.shows_plan and self._planner.replans > before:
            self._board.announce_replan(observation.time)

    def _paths_to(self, visit: Visit) -> PathsToNext:
        """The paths to the next visit; they are not computed before a condition asks for them."""
        if self._path_from is not None:
            start, self._path_from = self._path_from, None
            self._paths.begin(self._last_visit_at, start.position, *self._places(start, visit))
        return self._paths

    def _places_to_follow(
        self, observation: Observation
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        """`_places` of the next visit; None while no path to it was asked for."""
        if self._path_from is not None or (visit := self._planner.next) is None:
            return None
        return self._places(observation, visit)

    def _goal(self, observation: Observation, visit: Visit) -> NDArray[np.float64]:
        """Where a visit happens, m, shape (2,)."""
        return np.array(self._board.goal(observation, visit)[:2])

    def _places(
        self, observation: Observation, visit: Visit
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Where the path to a visit leads, and the goal of the visit, m, both of shape (2,)."""
        goal = self._goal(observation, visit)
        if visit.kind is VisitKind.PICK:
            return goal, goal
        return self._house.receptacles[self._episode.targets[visit.object]].approach[:2], goal


def deliveries(house: House, episode: Episode) -> dict[str, XY]:
    """Where a person stands to deliver each object, by name, m."""
    return {name: _xy(house.receptacles[key].approach) for name, key in episode.targets.items()}


def _xy(point: NDArray[np.float64]) -> XY:
    return float(point[0]), float(point[1])
