"""The planner of the paper, which uses the routing library of OR-Tools (PAPER section 2, equation 1)."""

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from ortools.constraint_solver import pywrapcp, routing_enums_pb2

from planner.greedy_solver import GreedySolver, nearest_first
from planner.plan import Certificate, Plan, Proof, Visit
from planner.problem import RoutingProblem, make_plan, possible_next, spanning_bound, tour_length
from planner.solvers import Deadline, SolveLimit

FIRST_SOLUTIONS = (1, 10)  # number of solutions after which the first two searches of `improve` stop
# The same for other searches by default. A search takes 0.1 s for 6 objects and 2 s for 24 objects.
DEFAULT_SOLUTIONS = 200
MAX_INSERTED = 250  # maximum number of nodes for which the insertion heuristic is used
MAX_COUNTED = 1e9  # longest time limit that OR-Tools accepts, in seconds
MAX_SECONDS = 60.0  # time limit in seconds, in case a search does not find enough solutions


@dataclass(frozen=True)
class OrToolsSolver:
    """A planner that uses parallel cheapest insertion, followed by guided local search.

    `SolveLimit.work` is the maximum number of solutions that the local search accepts.
    """

    name: str = "ortools"

    def solve(self, problem: RoutingProblem, *, seed: int = 0, limit: SolveLimit | None = None) -> Plan:
        """Solve a problem. Stop after a number of solutions or seconds. The seed has no effect.

        With up to three objects, all tours are tried and the plan is OPTIMAL. With more objects, the plan's
        lower bound is the length of a spanning tree.
        """
        del seed
        started = time.perf_counter()
        legs = problem.integers.legs
        if len(problem.shipments) + len(problem.onboard) <= 3:
            visits, bound = best_of_all(problem, legs)
            proof = Proof.EXHAUSTIVE
        else:
            bound, proof = spanning_bound(problem), Proof.SPANNING_TREE
            visits = _search(problem, legs, _with_budget(limit), started)
        certificate = Certificate(proof, problem.integers.unit, bound)
        return make_plan(problem, visits, tour_length(problem, visits, legs), bound, started, certificate)

    def improve(
        self, problem: RoutingProblem, *, seed: int = 0, limit: SolveLimit | None = None
    ) -> Iterator[Plan]:
        """Yield the greedy tour immediately, then better tours from searches of increasing length.

        The searches stop after 1, 10 and `limit.work` solutions. Each of them starts from scratch.
        """
        started = time.perf_counter()
        best = GreedySolver().solve(problem)
        yield best
        limit = _with_budget(limit)
        deadline = Deadline.of(limit, started)
        for work in (*(w for w in FIRST_SOLUTIONS if limit.work is None or w < limit.work), limit.work):
            if (left := deadline.left) == 0.0:
                return
            seconds = None if math.isinf(left) else left
            plan = self.solve(problem, seed=seed, limit=replace(limit, work=work, seconds=seconds))
            if plan.improves_on(best):
                best = plan
                yield best


def _with_budget(limit: SolveLimit | None) -> SolveLimit:
    limit = limit or SolveLimit()
    return replace(limit, work=DEFAULT_SOLUTIONS) if limit.work is limit.seconds is None else limit


def best_of_all(problem: RoutingProblem, distances: NDArray[np.int64]) -> tuple[list[Visit], int]:
    """Try all tours, and return the shortest one and its integer length. Suitable only for a few objects."""
    best: list[Visit] = []
    best_length = math.inf

    def extend(visits: list[Visit], here: int, length: int) -> None:
        nonlocal best, best_length
        if length >= best_length:
            return
        options = list(possible_next(problem, visits))
        if not options:
            best, best_length = visits, length
        for option in options:
            there = problem.location(option)
            extend([*visits, option], there, length + int(distances[here, there]))

    extend([], problem.start, 0)
    return best, int(best_length)


def _search(
    problem: RoutingProblem, distances: NDArray[np.int64], limit: SolveLimit, started: float
) -> list[Visit]:
    visit_of = _nodes(problem)
    count = len(visit_of) + 1  # Node 0 is start and end. The leg back costs nothing, so the tour is open.
    manager = pywrapcp.RoutingIndexManager(count, 1, 0)
    routing = pywrapcp.RoutingModel(manager)
    location = problem.stops(visit_of)
    # Adding 1 to every leg does not change the best tour, but lets the search penalize legs of length 0.
    costs = distances[np.ix_(location, location)] + 1
    costs[:, 0] = 0
    routing.SetArcCostEvaluatorOfAllVehicles(routing.RegisterTransitMatrix(costs.tolist()))
    _constrain(problem, manager, routing)
    if limit.stop is not None:
        # OR-Tools also releases the interpreter lock each time it checks this limit.
        routing.AddSearchMonitor(routing.solver().CustomLimit(limit.stop.is_set))
    solution = routing.SolveWithParameters(_parameters(limit, started)) if count <= MAX_INSERTED else None
    if solution is None:
        # Insertion fails if time runs out. It can also fail if the tour starts with full hands.
        greedy = nearest_first(problem)
        node = {visit: k + 1 for k, visit in enumerate(visit_of)}
        first = routing.ReadAssignmentFromRoutes([[node[v] for v in greedy]], True)
        solution = routing.SolveFromAssignmentWithParameters(first, _parameters(limit, started))
        if solution is None:
            return greedy
    visits = []
    index = solution.Value(routing.NextVar(routing.Start(0)))
    while not routing.IsEnd(index):
        visits.append(visit_of[manager.IndexToNode(index) - 1])
        index = solution.Value(routing.NextVar(index))
    return visits


def _nodes(problem: RoutingProblem) -> list[Visit]:
    n = len(problem.shipments)
    nodes = [visit for k in range(n) for visit in (problem.pick(k), problem.place(k))]
    return nodes + [problem.place(k) for k in range(n, len(problem.names))]


def _constrain(
    problem: RoutingProblem, manager: pywrapcp.RoutingIndexManager, routing: pywrapcp.RoutingModel
) -> None:
    shipments, carried = len(problem.shipments), len(problem.onboard)
    loads = [0, *(1, -1) * shipments, *(-1,) * carried]
    load = routing.RegisterUnaryTransitVector(loads)
    routing.AddDimension(load, 0, problem.capacity, False, "load")
    routing.GetDimensionOrDie("load").CumulVar(routing.Start(0)).SetValue(carried)
    step = routing.RegisterUnaryTransitVector([1] * len(loads))
    routing.AddDimension(step, 0, len(loads), True, "step")
    steps = routing.GetDimensionOrDie("step")
    for k in range(shipments):
        pickup, delivery = manager.NodeToIndex(1 + 2 * k), manager.NodeToIndex(2 + 2 * k)
        routing.AddPickupAndDelivery(pickup, delivery)
        routing.solver().Add(steps.CumulVar(pickup) <= steps.CumulVar(delivery))


def _parameters(limit: SolveLimit, started: float) -> object:
    parameters = pywrapcp.DefaultRoutingSearchParameters()
    parameters.first_solution_strategy = routing_enums_pb2.FirstSolutionStrategy.PARALLEL_CHEAPEST_INSERTION
    parameters.local_search_metaheuristic = routing_enums_pb2.LocalSearchMetaheuristic.GUIDED_LOCAL_SEARCH
    if limit.work is not None:
        parameters.solution_limit = limit.work
    seconds = MAX_SECONDS
    if limit.seconds is not None:
        seconds = limit.seconds - (time.perf_counter() - started)
    parameters.time_limit.FromMilliseconds(max(1, round(min(seconds, MAX_COUNTED) * 1000)))
    return parameters
