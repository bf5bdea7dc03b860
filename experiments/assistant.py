"""The assistant: sees the whole house, plans, judges each visit against its plan, and fills the glasses."""

import functools
import math
from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from experiments.conditions import STEP, TaskBoard, alternatives
from experiments.house import House
from experiments.participants.base import Choice, Guidance
from experiments.records import EventLog
from experiments.regrets import Regrets, RegretsAtOnce
from hud.conditions import condition
from hud.projection import CameraView
from hud.state import HudState
from mjsim.actions import EventKind, WorldEvent
from mjsim.episode import CAPACITY, Episode
from mjsim.observation import ObjectStatus, Observation
from planner.plan import Status, Visit, VisitKind
from planner.polyline import first_off_path, project, rest_of
from planner.route import XY, Route, TaskState

OFF_THE_PATH = 0.6  # m from the shown path before a new one is shown
GOAL = "goal"  # role of the markers of conditions that show the plan
MOVED = 0.25  # m an object may be pushed before the way to it is shown anew
FAMILIARISATION = 20.0  # s of wall time to prove the plan before the clock starts

VISIT_KIND = {EventKind.PICKED: VisitKind.PICK, EventKind.PLACED: VisitKind.PLACE}


class RoutePlanner(Protocol):
    """Keeps the route of a task; the replanners of `planner` do, and a replay with the logged plans.

    Attributes:
        replans: How often `update` made a new plan because the old one no longer fitted.
    """

    replans: int

    @property
    def pending(self) -> bool:
        """Whether `poll` may have a better route."""
        ...

    def prepare(self, state: TaskState, *, seconds: float | None = None) -> Route:
        """Plan before the clock starts, with at most `seconds` of wall time for proofs."""
        ...

    def update(self, state: TaskState) -> Route:
        """The route for the task as it is now."""
        ...

    def poll(self, state: TaskState) -> Route | None:
        """A better route for the same task, if one was found meanwhile."""
        ...


class Assistant:
    """Keeps a route for the state of the task, and says what the glasses show.

    It plans in every condition, because deviations are counted against its plan in all of them (PAPER section 6);
    whether the plan is shown is up to the condition.

    Args:
        house: The house.
        episode: The disorganized house.
        assistance: Name of the assistance condition.
        replanner: Plans routes.
        order: Object names in this participant's random order.
        log: Where plans and visits are logged.
        regrets: Works out what alternatives cost; None for one whose answers repeat.
        judging: Whether the regret of every visit is logged.

    Attributes:
        shown_roles: Roles of the markers that the condition shows at the start of the task.
    """

    def __init__(
        self,
        house: House,
        episode: Episode,
        *,
        assistance: str,
        replanner: RoutePlanner,
        order: Sequence[str],
        log: EventLog,
        regrets: Regrets | None = None,
        judging: bool = False,
    ) -> None:
        self._house = house
        self._episode = episode
        self._show = condition(assistance)
        self._replanner = replanner
        self._log = log
        self._regrets = regrets or RegretsAtOnce(house.geodesics)
        self._judging = judging
        self._visits = 0
        self._board = TaskBoard(house, episode, order)
        self._number = {placed.name: i for i, placed in enumerate(episode.objects)}
        self._deliveries = {
            name: _xy(house.receptacles[key].approach) for name, key in episode.targets.items()
        }
        self._route: Route | None = None
        self._path: NDArray[np.float64] | None = None
        self.shown_roles: frozenset[str] = frozenset()
        self._path_goal = np.zeros(2)
        self._stood = np.zeros(2)

    def familiarise(self, observation: Observation) -> None:
        """What takes long is done before the clock starts: load the planner, plan and prove, learn prices."""
        state = self._task_state(observation)
        route = self._replanner.prepare(state, seconds=FAMILIARISATION)
        self._regrets.prepare(state, route.plan)

    def begin(self, observation: Observation) -> None:
        """Plan for the start of the task."""
        self._stood = observation.position.copy()
        self._plan(observation)
        self.say("started", observation.time)
        self.shown_roles = frozenset(marker.role for marker in self.hud_state(observation).markers)

    def observe(self, observation: Observation, events: Sequence[WorldEvent]) -> None:
        """Take note of what happened in the last control step; replan where the person left the plan."""
        for event in events:
            if event.kind in VISIT_KIND:
                self._visited(observation, event)
        if events:
            self._plan(observation)
            return
        if self._replanner.pending:
            self._improve(observation)
        if self._path_is_stale(observation):
            self._show_way(observation, observation.position)

    @property
    def expecting(self) -> bool:
        """Whether a better plan may turn up at any moment, so that every control step has to be observed."""
        return self._replanner.pending

    def observe_walk(self, positions: NDArray[np.float64], observation: Observation) -> None:
        """Take note of a walk on which nothing happened and nothing moved, as `observe` of each step would.

        Args:
            positions: Where the person was after every control step, m, shape (n, 2).
            observation: State at the end.
        """
        first = 0
        while self._path is not None and first < len(positions):
            astray = first_off_path(self._path, positions, first, OFF_THE_PATH)
            if astray < 0:
                return
            self._show_way(observation, positions[astray])
            first = astray + 1

    def say(self, key: str, time: float, object_name: str | None = None) -> None:
        """Put a message about an event or a refusal into the message bar."""
        self._board.say(key, time, object_name)

    def hud_state(self, observation: Observation, camera: CameraView | None = None) -> HudState:
        """What the glasses show now."""
        visits = self._route.visits if self._route else ()
        plan = [(STEP[v.kind], v.object) for v in visits]
        view = self._board.view(
            observation,
            plan=plan,
            path=self._ahead(observation),
            camera=camera,
            alternatives=lambda: alternatives(self._regrets.known()),
        )
        return self._show(view)

    def guidance(self, observation: Observation) -> Guidance | None:
        """The next step and the path to it; None when all is done."""
        visit = self._route.next if self._route else None
        if self._path is None or visit is None:
            return None
        goal = self._goal(observation, visit.kind, visit.object)
        return Guidance(visit, self._path, goal, OFF_THE_PATH)

    def choices(self, observation: Observation) -> tuple[Choice, ...]:
        """What can be done next and what it costs compared with the best, the best first; empty until it is known."""
        return tuple(
            Choice(
                visit,
                self._goal(observation, *visit),
                found.regret,
                found.capped,
                functools.partial(self._regrets.exact, visit),
            )
            for visit, found in self._regrets.known().items()
        )

    def finish(self, time: float) -> None:
        """The task is over: log the regrets of visits that could not be judged in time."""
        self._regrets.close()
        for number, regret in self._regrets.later():
            self._log.append(time, "regret", visit=number, regret_m=_rounded(regret))

    def _visited(self, observation: Observation, event: WorldEvent) -> None:
        made = Visit(VISIT_KIND[event.kind], event.object)
        suggested = self._route.next if self._route else None
        here = observation.position.copy()
        self._log.append(
            event.time,
            "visit",
            kind=made.kind.value,
            object=made.object,
            suggested=_as_json(suggested) if suggested else None,
            deviated=self._route is not None and self._route.next != made,
            alternatives=self._alternatives(observation, event),
            **self._judged(made),
            position=[round(float(v), 6) for v in here],
            geodesic_m=round(
                self._house.body_geodesics.shortest_path(self._stood, here).geodesic_distance, 6
            ),
        )
        self._visits += 1
        self._stood = here
        self._board.did(STEP[made.kind], made.object)

    def _judged(self, visit: Visit) -> dict[str, float | None]:
        """Extra cost of a visit, if that is wanted. The next one of a plan that is proven has none."""
        if not self._judging:
            return {}
        proven = self._route is not None and self._route.plan.status is Status.OPTIMAL
        follows = self._route is not None and self._route.next == visit
        return {"regret_m": 0.0 if proven and follows else _rounded(self._regrets.judge(self._visits, visit))}

    def _alternatives(self, observation: Observation, event: WorldEvent) -> int:
        """How many other visits were feasible when this one was made."""
        loose = set(observation.names_with(ObjectStatus.LOOSE))
        carried = set(observation.carried)
        if event.kind is EventKind.PICKED:
            loose, carried = loose | {event.object}, carried - {event.object}
        else:
            carried = carried | {event.object}
        return len(carried) + (len(loose) if len(carried) < CAPACITY else 0) - 1

    def _plan(self, observation: Observation) -> None:
        """Follow the plan on, or make a new one where the task is no longer as planned."""
        before = self._replanner.replans
        first = self._route is None
        state = self._task_state(observation)
        self._route = self._replanner.update(state)
        self._regrets.begin(state, self._route.plan)
        self._show_way(observation, observation.position)
        if not first and self._replanner.replans == before:
            return
        if not first and GOAL in self.shown_roles:
            self._board.announce_replan(observation.time)
        self._log_plan(observation, self._route)

    def _improve(self, observation: Observation) -> None:
        """Take up a better plan for the same task, found in the background."""
        better = self._replanner.poll(self._task_state(observation))
        if better is None:
            return
        changed = self._route is None or better.visits != self._route.visits
        self._route = better
        self._log_plan(observation, better, improved=True)
        if changed:
            self._show_way(observation, observation.position)

    def _log_plan(self, observation: Observation, route: Route, **more: bool) -> None:
        # Cost and bound are those of the state that the plan was made for; a better plan comes a little later.
        self._log.append(
            observation.time,
            "plan",
            cost_m=round(route.plan.cost, 6),
            lower_bound_m=round(route.plan.lower_bound, 6),
            status=route.plan.status.value,
            visits=[_as_json(v) for v in route.visits],
            **more,
        )

    def _task_state(self, observation: Observation) -> TaskState:
        loose = observation.names_with(ObjectStatus.LOOSE)
        return TaskState(
            position=_xy(observation.position),
            loose={name: _xy(self._position_of(observation, name)) for name in loose},
            carried=observation.carried,
            deliveries=self._deliveries,
        )

    def _position_of(self, observation: Observation, name: str) -> NDArray[np.float64]:
        return observation.object_positions[self._number[name], :2]

    def _goal(self, observation: Observation, kind: VisitKind, name: str) -> NDArray[np.float64]:
        """Where a visit happens: the object itself, or the middle of the receptacle, m, (2,)."""
        if kind is VisitKind.PICK:
            return self._position_of(observation, name)
        return self._house.receptacles[self._episode.targets[name]].center[:2]

    def _show_way(self, observation: Observation, start: NDArray[np.float64]) -> None:
        visit = self._route.next if self._route else None
        self._path = None
        if visit is not None:
            self._path_goal = self._goal(observation, visit.kind, visit.object).copy()
            target = self._path_goal if visit.kind is VisitKind.PICK else self._deliveries[visit.object]
            self._path = self._house.geodesics.shortest_path(start, target).points

    def _path_is_stale(self, observation: Observation) -> bool:
        visit = self._route.next if self._route else None
        if self._path is None or visit is None:
            return False
        x, y = observation.position
        strayed = project(self._path, x, y)[1] > OFF_THE_PATH
        return (
            strayed or math.dist(self._goal(observation, visit.kind, visit.object), self._path_goal) > MOVED
        )

    def _ahead(self, observation: Observation) -> NDArray[np.float64] | None:
        """What is left of the shown way, from the point of it nearest to the person, m, (k, 2)."""
        return None if self._path is None else rest_of(self._path, *observation.position)


def _xy(point: NDArray[np.float64]) -> XY:
    return float(point[0]), float(point[1])


def _rounded(metres: float | None) -> float | None:
    return None if metres is None else round(metres, 6)


def _as_json(visit: Visit) -> list[str]:
    return [visit.kind.value, visit.object]
