"""Planning alongside a live task: keep the plan while it is followed, else replan (PAPER section 2)."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from planner.errors import NotNavigableError, PlannerError, UnreachableError
from planner.geodesics import Geodesics, ShortestPath
from planner.plan import Plan, Visit, VisitKind
from planner.problem import RoutingProblem, Shipment
from planner.regret import RADIUS, Regret, regrets
from planner.route import XY, Route, RouteVisit, TaskState
from planner.solver import SolveLimit, Solver

Stop = tuple[VisitKind, str]

MOVED = 0.3  # m; an object that was pushed farther than this since it was planned for asks for a new plan


def named(plan: Plan, names: Sequence[str], state: TaskState) -> list[Stop]:
    """The visits of a plan by name; `names` are those of its shipments, `state` is what it was made for."""
    return [name_of(visit, names, state) for visit in plan.visits]


def name_of(visit: Visit, names: Sequence[str], state: TaskState) -> Stop:
    """A visit by name; `names` are those of the problem's shipments, `state` is what it was made for."""
    name = names[visit.shipment] if visit.shipment is not None else state.carried[visit.onboard or 0]
    return visit.kind, name


def left_of(stops: Sequence[Stop], state: TaskState) -> list[Stop] | None:
    """The stops that are still to be done if what was done is a beginning of them, else None."""
    loose = {name for kind, name in stops if kind is VisitKind.PICK}
    carried = {name for _, name in stops} - loose
    done = 0
    while (loose, carried) != (set(state.loose), set(state.carried)):
        if done == len(stops):
            return None
        kind, name = stops[done]
        done += 1
        if kind is VisitKind.PICK:
            loose.remove(name)
            carried.add(name)
        else:
            carried.remove(name)
    return list(stops[done:])


class Replanner:
    """Plans the rest of a task again whenever the person departs from the plan.

    Every position stands for the nearest point of the navmesh's largest island.

    Attributes:
        geodesics: Distances and paths.
        solver: Finds the tours.
        capacity: How many objects can be carried.
        seed: Handed to the solver.
        limit: Handed to the solver.
        replans: How often `update` made a new plan because the old one no longer fitted.
    """

    def __init__(
        self,
        geodesics: Geodesics,
        solver: Solver,
        *,
        capacity: int = 2,
        seed: int = 0,
        limit: SolveLimit | None = None,
    ) -> None:
        self.geodesics = geodesics
        self.solver = solver
        self.capacity = capacity
        self.seed = seed
        self.limit = limit
        self.replans = 0
        self._route: Route | None = None
        self._planned: dict[str, XY] = {}  # where the loose objects of the route lay when it was solved
        self._known: dict[XY, int] = {}
        self._distances: NDArray[np.float64] = np.zeros((0, 0))

    @property
    def route(self) -> Route:
        """The current route.

        Raises:
            PlannerError: Nothing was planned yet.
        """
        if self._route is None:
            raise PlannerError("no route yet; call plan or update with the state of the task first")
        return self._route

    def plan(self, state: TaskState, *, limit: SolveLimit | None = None) -> Route:
        """Plan the rest of the task from scratch and follow that from now on.

        Args:
            state: The task as it is now.
            limit: Overrides the replanner's own limit this once.

        Raises:
            UnreachableError: Objects that cannot be fetched or delivered; `names` lists them.
            ProblemError: More is carried than the capacity allows.
        """
        problem, names, spots = self.task(state)
        plan = self._first_plan(problem, names, state, limit or self.limit)
        visits = tuple(RouteVisit(kind, name, spots[kind, name]) for kind, name in named(plan, names, state))
        self._route = Route(visits, plan.cost, plan)
        self._planned = dict(state.loose)
        return self._route

    def prepare(self, state: TaskState, *, seconds: float | None = None) -> Route:  # noqa: ARG002 - it never waits
        """Plan the task before its clock starts.

        Args:
            state: The task at its start.
            seconds: Longest wait for proofs in the background, if the replanner makes them.
        """
        return self.plan(state)

    @property
    def pending(self) -> bool:
        """Whether `poll` has something to look at; it never has for this replanner."""
        return False

    def poll(self, state: TaskState) -> Route | None:  # noqa: ARG002 - nothing goes on behind the scenes
        """A better route than the one shown, if one was found meanwhile; this replanner finds none."""
        return None

    def _first_plan(
        self,
        problem: RoutingProblem,
        names: list[str],  # noqa: ARG002 - for replanners that know something of these objects
        state: TaskState,  # noqa: ARG002
        limit: SolveLimit | None,
    ) -> Plan:
        return self.solver.solve(problem, seed=self.seed, limit=limit)

    def update(self, state: TaskState) -> Route:
        """The route for the task as it is now.

        If what was done since is the beginning of the route, the rest of it stays, with fresh positions;
        otherwise (or if an object was pushed far) the task is planned anew and `replans` goes up by one.

        Raises:
            UnreachableError: Objects that cannot be fetched or delivered; `names` lists them.
            ProblemError: More is carried than the capacity allows.
        """
        if self._route is None:
            return self.plan(state)
        rest = self._rest(state)
        if rest is None:
            self.replans += 1
            return self.plan(state)
        spots = self._spots(state)
        visits = tuple(replace(v, location=spots[v.kind, v.object]) for v in rest)
        here = self._snap(state.position)
        self._route = Route(visits, self._length(here, [v.location for v in visits]), self._route.plan)
        return self._route

    def segment(self, position: XY) -> ShortestPath:
        """The shortest path from a position to the next visit (PAPER section 2: what the HUD shows).

        Raises:
            PlannerError: Nothing is planned, or nothing is left to do.
        """
        target = self.route.next
        if target is None:
            raise PlannerError("the route is finished; there is no next segment")
        return self.geodesics.shortest_path(self._snap(position), target.location)

    def problem(self, state: TaskState) -> RoutingProblem:
        """The routing problem of a state: shipments in the order of `loose`, onboard as in `carried`.

        Raises:
            UnreachableError: Objects that cannot be fetched or delivered; `names` lists them.
            ProblemError: More is carried than the capacity allows.
        """
        return self.task(state)[0]

    def task(self, state: TaskState) -> tuple[RoutingProblem, list[str], dict[tuple[VisitKind, str], XY]]:
        """As `problem`, with the names of the shipments and where each visit takes place."""
        spots = self._spots(state)
        return *self._problem(state, spots), spots

    def regrets(self, state: TaskState, *, radius: float = RADIUS) -> dict[Stop, Regret]:
        """What each possible next visit costs compared with the best one, the best first.

        Args:
            state: The task as it is now.
            radius: Regrets up to here are wanted exactly, m; see :func:`planner.regret.regrets`.

        Raises:
            UnreachableError: Objects that cannot be fetched or delivered; `names` lists them.
            ProblemError: More is carried than the capacity allows, or the radius is negative.
        """
        problem, names = self._problem(state, self._spots(state))
        found = regrets(problem, self.solver, seed=self.seed, limit=self.limit, radius=radius)
        return {name_of(regret.visit, names, state): regret for regret in found}

    def _rest(self, state: TaskState) -> list[RouteVisit] | None:
        """The visits of the route that are still to be done, or None if the state is not on the route."""
        visits = self.route.visits
        stops = left_of([(v.kind, v.object) for v in visits], state)
        if stops is None:
            return None
        if any(math.dist(at, self._planned[name]) > MOVED for name, at in state.loose.items()):
            return None
        return list(visits[len(visits) - len(stops) :])

    def _snap(self, position: XY, max_distance: float = math.inf) -> XY:
        x, y = self.geodesics.navmesh.snap(position, max_distance)
        return float(x), float(y)

    def _spots(self, state: TaskState) -> dict[tuple[VisitKind, str], XY]:
        """Navigable position of each visit that may be left."""
        wanted = {(VisitKind.PICK, name): at for name, at in state.loose.items()}
        wanted |= {(VisitKind.PLACE, name): state.deliveries[name] for name in (*state.loose, *state.carried)}
        spots, lost = {}, {}
        for (kind, name), at in wanted.items():
            try:
                spots[kind, name] = self._snap(at, self.geodesics.max_snap)
            except NotNavigableError as error:
                lost[name] = f"{name} ({kind.value}: {error})"
        if lost:
            raise UnreachableError(
                f"out of reach from where people walk: {'; '.join(lost.values())}; move them", tuple(lost)
            )
        return spots

    def _problem(
        self, state: TaskState, spots: dict[tuple[VisitKind, str], XY]
    ) -> tuple[RoutingProblem, list[str]]:
        here = self._snap(state.position)
        names = list(state.loose)
        places = list(dict.fromkeys(spots.values()))
        index = {at: k + 1 for k, at in enumerate(places)}
        distances = np.zeros((len(places) + 1, len(places) + 1))
        distances[1:, 1:] = self._between(places)
        if places:
            distances[0, 1:] = distances[1:, 0] = self.geodesics.distances_from(here, places)
        problem = RoutingProblem(
            distances,
            0,
            tuple(Shipment(index[spots[VisitKind.PICK, n]], index[spots[VisitKind.PLACE, n]]) for n in names),
            tuple(index[spots[VisitKind.PLACE, n]] for n in state.carried),
            self.capacity,
        )
        return problem, names

    def _between(self, places: list[XY]) -> NDArray[np.float64]:
        """Distances between places; only rows of places that are new since the last call are computed."""
        old = [p for p in places if p in self._known]
        new = [p for p in places if p not in self._known]
        order = {p: k for k, p in enumerate([*old, *new])}
        kept = [self._known[p] for p in old]
        result = np.zeros((len(order), len(order)))
        result[: len(old), : len(old)] = self._distances[np.ix_(kept, kept)]
        if new:
            rows = self.geodesics.distances_between(new, [*old, *new])
            square = rows[:, len(old) :]
            result[len(old) :, : len(old)] = rows[:, : len(old)]
            result[: len(old), len(old) :] = rows[:, : len(old)].T
            result[len(old) :, len(old) :] = np.minimum(square, square.T) * (1 - np.eye(len(new)))
        self._known, self._distances = order, result
        wanted = [order[p] for p in places]
        return result[np.ix_(wanted, wanted)]

    def _length(self, here: XY, stops: Sequence[XY]) -> float:
        places = list(dict.fromkeys(stops))
        if not places:
            return 0.0
        between = self._between(places)
        order = [places.index(stop) for stop in stops]
        first = self.geodesics.distances_from(here, [places[order[0]]])[0]
        return float(first + between[order[:-1], order[1:]].sum())
