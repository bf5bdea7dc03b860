"""The assistant: sees the whole house, plans, compares each visit with its plan, and says what the HUD shows."""

import functools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.house import House
from experiments.participants.base import Choice, Guidance
from experiments.runs.records import EventLog
from experiments.session.planning import Planning
from experiments.session.reach_bound import reach_bound
from experiments.session.regrets import Regrets
from experiments.session.shown_path import TOLERANCE, PathsToNext
from experiments.session.task_board import PlanShown, TaskBoard
from experiments.session.user_code import shown_by
from experiments.session.visit_fields import PlaceDistances, alternatives, as_json
from hud.conditions import condition
from hud.markers import BREADCRUMB, GOAL
from hud.projection import CameraView
from hud.state import HudState
from mjsim.actions import EventKind, WorldEvent
from mjsim.episode import Episode
from mjsim.observation import ObjectStatus, Observation
from mjsim.options import WorldOptions
from planner.plan import Status, Visit, VisitKind
from planner.regret import Regret
from planner.route import XY, Route, RoutePlanner, TaskState

PLAN_ROLES = frozenset({BREADCRUMB, GOAL})

VISIT_KIND = {EventKind.PICKED: VisitKind.PICK, EventKind.PLACED: VisitKind.PLACE}


class Assistant:
    """Keeps a route for the state of the task, and says what the HUD shows.

    It plans in every condition; whether the plan is shown is up to the condition.

    Args:
        board: Describes the task to the condition.
        assistance: Name of the assistance condition.
        planner: Plans routes.
        log: Where plans and visits are logged.
        regrets: Works out what alternatives cost; None for one whose answers repeat.
        log_regrets: Whether the regret of every visit is logged.
        options: Rules of the world, for how much a person carries.
        background: Whether plans that nobody sees are made in a thread (`Planning`).

    Attributes:
        shown_roles: Roles of the markers that the condition shows at the start of the task.
        shows_plan: Whether the condition shows the plan or where it leads next.
    """

    def __init__(
        self,
        board: TaskBoard,
        *,
        assistance: str,
        planner: RoutePlanner,
        log: EventLog,
        regrets: Regrets | None = None,
        log_regrets: bool = False,
        options: WorldOptions | None = None,
        background: bool = False,
    ) -> None:
        self._board, self._house, self._episode = board, board.house, board.episode
        self._assistance, self._show = assistance, condition(assistance)
        self._log = log
        self._options = options or WorldOptions()
        self._regrets = regrets or Regrets(self._house.geodesics, self._options.capacity)
        self._planning = Planning(planner, self._regrets, log, background=background)
        self._log_regrets = log_regrets
        self._number = {placed.name: i for i, placed in enumerate(self._episode.objects)}
        self._deliveries = deliveries(self._house, self._episode)
        self._paths = PathsToNext(self._house.geodesics)
        self._leads_from: tuple[NDArray[np.float64], Observation] | None = (
            None  # what the paths are not begun from yet
        )
        self._visits = 0
        self.shown_roles: frozenset[str] = frozenset()
        self.shows_plan = self._rerouted = False

    def begin(self, observation: Observation) -> None:
        """Plan for the start of the task."""
        self._last_visit_at = observation.position.copy()
        self._state = self.task_state(observation)
        self._places_visited = PlaceDistances(self._house.geodesics, self._state.position)
        self._plan(observation)
        self.show_message("started", observation.time)
        state = self.hud_state(observation)
        self.shown_roles = frozenset(marker.role for marker in state.markers)
        self._rerouted = state.rerouted
        numbered = any(item.number is not None for item in state.checklist)
        self.shows_plan = numbered or not self.shown_roles.isdisjoint(PLAN_ROLES)
        if self.shows_plan:
            self._planning.stay()

    def observe(self, observation: Observation, events: Sequence[WorldEvent]) -> None:
        """Take note of the last control step, and of what happened in it; replan where the person left the plan."""
        for event in events:
            if event.kind in VISIT_KIND:
                self._note_visit(observation, event)
            self.show_message(event.kind.value, observation.time, event.object)
        if events:
            self._plan(observation)
            return
        if self.expecting and self._planning.improve(observation.time, self.task_state(observation)):
            self._begin_path(observation)
        if self._leads_from is None and (visit := self._planning.next) is not None:
            self._paths.follow(observation.position, *self._places(observation, visit))

    @property
    def expecting(self) -> bool:
        """Whether a better plan may turn up at any moment, so that every control step has to be observed."""
        return self._planning.planner.pending

    def observe_walk(self, positions: NDArray[np.float64], observation: Observation) -> None:
        """Take note of a walk on which nothing happened and nothing moved, as `observe` of each step would.

        Args:
            positions: Where the person was after every control step, m, shape (n, 2).
            observation: State at the end.
        """
        if self._leads_from is None and (visit := self._planning.next) is not None:
            self._paths.path.follow_walk(positions, *self._places(observation, visit))

    def show_message(self, key: str, time: float, object_name: str | None = None) -> None:
        """Put a message about an event or a refusal into the message bar."""
        self._board.show_message(key, time, object_name)

    def scroll(self, rows: int) -> None:
        """Scroll the task list by so many rows, positive towards its end."""
        self._board.scroll(rows)

    def hud_state(self, observation: Observation, camera: CameraView | None = None) -> HudState:
        """What the HUD shows now; a condition needs the eye camera to point to a goal out of view."""
        view = self._board.view(
            observation,
            ahead=PlanShown(self._board, observation, lambda: self._planning.route, self._paths_to),
            capacity=self._options.capacity,
            camera=camera,
            regrets=self._known_regrets,
        )
        return shown_by(self._show, self._assistance, view)

    def guidance(self, observation: Observation) -> Guidance | None:
        """The next step and the path that the breadcrumbs mark; None where there are none, or when all is done."""
        if BREADCRUMB not in self.shown_roles or (visit := self._planning.next) is None:
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
                functools.partial(self._regrets.exact, visit),
            )
            for visit, found in self._known_regrets().items()
        )

    def finish(self, time: float) -> None:
        """The task is over: log the regrets of visits that were not known in time."""
        self._planning.stay()
        self._regrets.close()
        for (number, names), regret in self._regrets.later():
            self._log.append(time, "regret", visit=number, **dict.fromkeys(names, _rounded(regret)))

    def task_state(self, observation: Observation) -> TaskState:
        """The task in the planner's terms."""
        loose = observation.names_with(ObjectStatus.LOOSE)
        return TaskState(
            position=_xy(observation.position),
            loose={name: _xy(self._position_of(observation, name)) for name in loose},
            carried=observation.carried,
            deliveries=self._deliveries,
        )

    def _known_regrets(self) -> Mapping[Visit, Regret]:
        """Regrets of all possible next visits; empty as long as they are not known."""
        _ = self._planning.route  # the regrets are those beside the plan
        return self._regrets.known()

    def _note_visit(self, observation: Observation, event: WorldEvent) -> None:
        made, here, state = (
            Visit(VISIT_KIND[event.kind], event.object),
            observation.position.copy(),
            self._state,
        )
        walk = self._house.body_geodesics.shortest_path(self._last_visit_at, here)
        location, number = self._places_visited.next(state, made), self._visits

        def fields(route: Route | None) -> dict[str, Any]:
            suggested = route.next if route else None
            return {
                "kind": made.kind.value,
                "object": made.object,
                "suggested": as_json(suggested) if suggested else None,
                "deviated": route is not None and suggested != made,
                **alternatives(state, made, suggested, self._episode.targets, self._options.capacity),
                **self._regret_fields(number, made, route),
                "position": [round(float(v), 6) for v in here],
                "geodesic_m": round(walk.geodesic_distance, 6),
                "location_m": round(location, 6),
            }

        self._planning.log(event.time, "visit", fields)
        self._visits += 1
        self._last_visit_at = here
        self._board.note_visit(made)

    def _regret_fields(self, number: int, made: Visit, route: Route | None) -> dict[str, float | None]:
        """Extra cost of a visit and of the suggested one, if that is wanted."""
        if not self._log_regrets:
            return {}
        suggested = route.next if route else None

        def regret(names: tuple[str, ...], visit: Visit) -> dict[str, float | None]:
            """Under these names; the next visit of a plan that is proven has none."""
            found: float | None = 0.0
            if route is None or route.plan.status is not Status.OPTIMAL or suggested != visit:
                found = _rounded(self._regrets.evaluate((number, names), visit))
            return dict.fromkeys(names, found)

        if suggested is None or suggested == made:
            return regret(("regret_m", "suggested_regret_m"), made)
        return regret(("regret_m",), made) | regret(("suggested_regret_m",), suggested)

    def _plan(self, observation: Observation) -> None:
        """Follow the plan on, or make a new one where the task is no longer as planned."""
        before = self._planning.planner.replans if self.shows_plan else 0
        self._state = state = self.task_state(observation)

        def more(first: Route) -> dict[str, float]:
            bound = reach_bound(round(first.plan.lower_bound, 6), self._house, self._episode)
            return {"reach_bound_m": round(bound, 6)}

        self._planning.update(observation.time, state, shown=self.shows_plan, more=more)
        self._begin_path(observation)
        if self.shows_plan and self._planning.planner.replans > before:
            self._board.announce_replan(observation.time)

    def _begin_path(self, observation: Observation) -> None:
        """From now on, show the way to the next visit: the segment from the last one, and the path from here."""
        self._leads_from = self._last_visit_at, observation

    def _paths_to(self, visit: Visit) -> PathsToNext:
        """The paths to the next visit; nothing is done about them before a condition asks for them."""
        if self._leads_from is not None:
            last_visit, observation = self._leads_from
            self._leads_from = None
            self._paths.begin(last_visit, observation.position, *self._places(observation, visit))
        return self._paths

    def _position_of(self, observation: Observation, name: str) -> NDArray[np.float64]:
        return observation.object_positions[self._number[name], :2]

    def _goal(self, observation: Observation, visit: Visit) -> NDArray[np.float64]:
        """Where a visit happens: the object itself, or the middle of the receptacle, m, (2,)."""
        if visit.kind is VisitKind.PICK:
            return self._position_of(observation, visit.object)
        return self._house.receptacles[self._episode.targets[visit.object]].center[:2]

    def _places(
        self, observation: Observation, visit: Visit
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Where the path to a visit leads, and the goal of the visit, m, both of shape (2,)."""
        goal = self._goal(observation, visit)
        if visit.kind is VisitKind.PICK:
            return goal, goal
        return self._house.receptacles[self._episode.targets[visit.object]].approach[:2], goal


def deliveries(house: House, episode: Episode) -> dict[str, XY]:
    """Where one stands to deliver each object, by name, m."""
    return {name: _xy(house.receptacles[key].approach) for name, key in episode.targets.items()}


def _xy(point: NDArray[np.float64]) -> XY:
    return float(point[0]), float(point[1])


def _rounded(metres: float | None) -> float | None:
    return None if metres is None else round(metres, 6)
