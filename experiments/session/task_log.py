"""Log the plans and visits of a session, with suggested visits and regrets."""

import itertools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.house import House
from experiments.record.records import EventLog
from mjsim.house.compiled.sites import ReceptacleGeometry
from mjsim.values.episode import Episode
from planner.plan import Status, Visit, VisitKind
from planner.regret import RegretBounds
from planner.route import Route, TaskState
from planner.service import Planner


class TaskLog:
    """A log of plans and visits, which is needed to measure deviations from the plan (PAPER section 6).

    Plans are logged even if they are not shown.
    """

    def __init__(
        self, planner: Planner, log: EventLog, house: House, episode: Episode, *, capacity: int, regrets: bool
    ) -> None:
        self._planner, self._log, self._house, self._episode = planner, log, house, episode
        self._capacity, self._regrets = capacity, regrets
        self._state: TaskState | None = None
        self._visits = 0

    def plan(self, time: float, state: TaskState, position: NDArray[Any], *, shown: bool) -> None:
        """Request a plan for a state, and log it if it is new. `position` is the person's position in metres.

        Raises UnreachableError with the object names if objects cannot be fetched or delivered.
        """
        first = self._state is None
        if first:
            self._last_visit_at = position
            self._last_place = state.position
        self._state = state
        is_new, route = self._planner.ask(state, shown=shown), self._planner.route
        if is_new and route is not None:
            fields = _plan_fields(route)
            if first:
                bound = reach_bound(round(route.plan.lower_bound, 6), self._house, self._episode)
                fields["reach_bound_m"] = round(bound, 6)
            self._log.append(time, "plan", **fields)

    def improve(self, time: float, state: TaskState) -> bool:
        """Adopt a better plan for the same task if there is one. Return True if its visits differ."""
        before, better = self._planner.route, self._planner.improve(state)
        if better is None:
            return False
        self._log.append(time, "plan", **_plan_fields(better), improved=True)
        return before is None or better.visits != before.visits

    def visit(self, time: float, made: Visit, position: NDArray[Any]) -> None:
        """Log a visit and compare it with the plan. `position` is the person's position in metres."""
        assert self._state is not None  # noqa: S101 - for the type checker
        state, route = self._state, self._planner.route
        walk = self._house.body_geodesics.shortest_path(self._last_visit_at, position)
        suggested = route.next if route else None
        fields = {
            "kind": made.kind.value,
            "object": made.object,
            "suggested": _as_json(suggested) if suggested else None,
            "deviated": route is not None and suggested != made,
            **self._alternatives(state, made, suggested),
            **(self._regrets_of(made, route) if self._regrets else {}),
            "position": [round(float(v), 6) for v in position],
            "geodesic_m": round(walk.geodesic_distance, 6),
            "location_m": round(self._distance_to(state, made), 6),
        }
        self._log.append(time, "visit", **fields)
        self._visits += 1
        self._last_visit_at = position

    def finish(self, time: float) -> None:
        """Log the regrets that had not been computed yet when the visits were logged."""
        for (number, names), regret in self._planner.finish():
            self._log.append(time, "regret", visit=number, **_regret_fields(names, regret))

    def _distance_to(self, state: TaskState, made: Visit) -> float:
        place = state.deliveries[made.object]
        if made.kind is VisitKind.PICK:
            place = state.loose.get(made.object, state.position)
        snap = self._house.geodesics.navmesh.snap
        here, there = snap(np.array(self._last_place)), snap(np.array(place))
        self._last_place = place
        return float(self._house.geodesics.shortest_path(here, there).geodesic_distance)

    def _alternatives(self, state: TaskState, made: Visit, suggested: Visit | None) -> dict[str, int | bool]:
        feasible = len(state.carried) + (len(state.loose) if len(state.carried) < self._capacity else 0)
        tied: set[str] = set()
        if suggested is not None and suggested.kind is VisitKind.PLACE:
            targets = self._episode.targets
            tied = {name for name in state.carried if targets[name] == targets[suggested.object]}
        return {
            "alternatives": max(feasible - 1, 0),
            "tied_alternatives": max(len(tied) - 1, 0),
            "tied": made != suggested and made.kind is VisitKind.PLACE and made.object in tied,
        }

    def _regrets_of(self, made: Visit, route: Route | None) -> dict[str, Any]:
        proven = route is not None and route.plan.status is Status.OPTIMAL
        suggested = route.next if route else None
        names: dict[Visit, tuple[str, ...]] = {made: ("regret",)}
        other = suggested or made
        names[other] = (*names.get(other, ()), "suggested_regret")
        fields: dict[str, Any] = {}
        for visit, keys in names.items():
            if proven and visit == suggested:
                fields |= _regret_fields(keys, RegretBounds(0.0, 0.0, 0.0))
            else:
                fields |= _regret_fields(keys, self._planner.judge(visit, (self._visits, keys)))
        return fields


def _regret_fields(names: Sequence[str], found: RegretBounds | None) -> dict[str, Any]:
    if found is None:
        return {f"{name}_m": None for name in names}
    if found.exact is not None:
        return {f"{name}_m": round(found.exact, 6) for name in names}
    bounds = [math.floor(found.lower * 1e6) / 1e6, math.ceil(found.upper * 1e6) / 1e6]
    unproven = [{f"{name}_m": None, f"{name}_bounds_m": bounds} for name in names]
    return {key: value for fields in unproven for key, value in fields.items()}


def _plan_fields(route: Route) -> dict[str, Any]:
    return {
        "cost_m": round(route.plan.cost, 6),
        "lower_bound_m": round(route.plan.lower_bound, 6),
        "status": route.plan.status.value,
        "visits": [_as_json(v) for v in route.visits],
    }


def _as_json(visit: Visit) -> list[str]:
    return [visit.kind.value, visit.object]


def reach_bound(tour: float, house: House, episode: Episode) -> float:
    """Return a lower bound in metres on the walking distance for any order of visits.

    `tour` is a lower bound in metres for a person who walks up to each location. People who reach for objects
    from a distance save this distance on the way to a location and on the way back, except after the last
    visit. The bound assumes that objects are not pushed and that people reach only across free floor.
    """
    reach = house.person.reach
    places = [
        reach + _extent(house.receptacles[key])
        for key in (episode.targets[placed.name] for placed in episode.objects)
    ]
    saved = 2 * (len(places) * reach + sum(places)) - min(places, default=0.0)
    return max(0.0, tour - saved)


def _extent(receptacle: ReceptacleGeometry) -> float:
    corners = np.array(list(itertools.product((-1.0, 1.0), repeat=3))) * receptacle.half_size
    floor = (corners @ receptacle.rotation.T + receptacle.center)[:, :2]
    return float(np.linalg.norm(floor - receptacle.approach, axis=1).max())
