"""Search for plans of successive task states. All searches together expand a limited number of states."""

import math
import time
from dataclasses import replace

import numpy as np

from planner.exact.instance import MAX_SEARCHED, Instance, make_instance, to_visits
from planner.exact.solver import ExactSolver
from planner.exact.warm_start import NOTHING_KNOWN, Start
from planner.plan import Plan, Status, Visit
from planner.problem import SAME, RoutingProblem, make_plan, possible_next, tour_length
from planner.solvers import Deadline, SolveLimit

TASK_WORK = 3_000_000  # default number of states that all searches of a task expand together
TABLE_OBJECTS = 18  # number of objects from which on a full table replaces the searches
PAUSE = 2  # number of picks after which the search is repeated if the last one proved nothing
HURRIED_ROWS = 600  # maximum number of rows in a table that has to be filled quickly
SEARCHES = 2  # number of searches per object, one after it is picked up and one after it is placed
# Moves and temperatures of the annealing of tours with many objects, for a first plan and for later plans
FIRST_MOVES, FIRST_TEMPERATURES = 100_000, (0.2, 0.04)
MOVES, TEMPERATURES = 20_000, (0.1, 0.02)


class TaskSearch:
    """A search that is repeated for successive states of a task, and expands a limited number of states in total.

    Each search may use an equal share of the remaining states, so that early searches, which are the hardest
    ones, leave states for later ones. After a search without a proof, two objects must be picked up before the
    next one. A search without multipliers of an earlier plan may use half of the states, because its
    multipliers serve all later searches. Without states, a plan results from annealing and these multipliers.
    Results are reproducible unless `limit` contains a time or a stop event.

    With more than 24 objects, only a search without multipliers expands states, because a proof is unlikely. The
    tours are annealed instead.

    Args:
        solver: Exact planner, whose passes are used.
        limit: Limit whose `work` applies to all searches together. `seconds` applies to each search.

    Attributes:
        left: Number of states that may still be expanded.
    """

    def __init__(self, solver: ExactSolver, limit: SolveLimit | None = None) -> None:
        self.left = (limit and limit.work) or TASK_WORK
        self._solver = solver
        self._warm = NOTHING_KNOWN
        self._began_large = False
        self._most = math.inf  # number of loose objects up to which a proof seems possible

    def learn(self, problem: RoutingProblem, plan: Plan) -> None:
        """Use the order of a plan for this problem, and its multipliers if it has any, in later searches."""
        self._warm = self._warm.updated(problem, plan)
        self._began_large |= self._is_large(problem)

    def continues(self, problem: RoutingProblem) -> bool:
        """Return True if all plans come from this search, because the task began with more than 24 objects."""
        if not self._solver.applies(problem) or not (self._began_large or self._is_large(problem)):
            return False
        return self._solver.tabled(problem) is None

    def _is_large(self, problem: RoutingProblem) -> bool:
        return len(problem.shipments) > self._solver.most_searched

    def start(self, problem: RoutingProblem, instance: Instance) -> Start | None:
        """Return a warm start for a problem, or None if nothing is known about its objects."""
        return self._warm.numbered(problem.names[: len(problem.shipments)], instance.unit)

    def share(self, problem: RoutingProblem) -> int:
        """Return the number of states that a search for this problem may expand."""
        n, large = len(problem.shipments), self._is_large(problem)
        objects = max(1, n - TABLE_OBJECTS)  # number of objects that are picked up before a full table fits
        if n > MAX_SEARCHED or n > self._most:
            return 0
        if not self._warm.multipliers:
            return self.left // (objects if large else 2)
        return 0 if large else self.left // (SEARCHES * objects)

    def spend(self, states: int) -> None:
        self.left = max(0, self.left - states)

    def plan(
        self,
        problem: RoutingProblem,
        *,
        seed: int = 0,
        limit: SolveLimit | None = None,
        before: tuple[RoutingProblem, Plan] | None = None,
    ) -> Plan:
        """Return the best plan that this problem's share of the budget allows. The solver must apply to the problem.

        `before` is the problem of an earlier state of the same task and its plan.
        """
        rest, lower = (None, 0.0) if before is None else rest_of(*before, problem)
        if rest is not None and self._is_large(problem):
            plan = self._bounded(problem, rest)
        else:
            plan = self._searched(problem, seed, limit)
        return plan.bounded(max(lower, plan.lower_bound), SAME)

    def _bounded(self, problem: RoutingProblem, visits: tuple[Visit, ...]) -> Plan:
        from planner.exact.multipliers import first_bound, warm_bound

        started, metric = time.perf_counter(), problem.integers.metric
        instance, length = make_instance(problem, metric), int(tour_length(problem, visits, metric))
        if (start := self.start(problem, instance)) is not None:
            bound = warm_bound(instance, start, HURRIED_ROWS)
        else:
            bound = first_bound(instance, length)
        return make_plan(problem, visits, length, bound.root, started, bound.certificate)

    def _searched(self, problem: RoutingProblem, seed: int, limit: SolveLimit | None) -> Plan:
        from planner.exact.search import WARM_ROWS, improving_tours  # this import takes 0.5 s

        started, metric, large = time.perf_counter(), problem.integers.metric, self._is_large(problem)
        instance, n = make_instance(problem, metric), len(problem.shipments)
        start, end = self.start(problem, instance), Deadline.of(limit)
        work = 0 if end.over() else self.share(problem)
        rows = HURRIED_ROWS if end.over() or large else WARM_ROWS
        *_, best = improving_tours(instance, seed, work, end, self._solver.passes, start, rows)
        self.spend(best.expanded)
        actions = _annealed(instance, seed, best.actions, first=start is None) if large else best.actions
        visits = to_visits(instance, actions, problem.names[:n], problem.names[n:])
        length = tour_length(problem, visits, metric)
        plan = make_plan(problem, visits, length, best.bound, started, best.certificate)
        if work and plan.status is not Status.OPTIMAL:
            self._most = min(self._most, n - PAUSE)
        is_better = plan.status is Status.OPTIMAL or not self._warm.multipliers
        self.learn(problem, plan if is_better else replace(plan, certificate=None))
        return plan


def _annealed(instance: Instance, seed: int, actions: list[int], *, first: bool) -> list[int]:
    from planner.exact.annealing import anneal, tour_actions
    from planner.exact.moves import moves_of

    order = np.array([k for k in actions if k >= 0], np.int64)
    moves, temperatures = (FIRST_MOVES, FIRST_TEMPERATURES) if first else (MOVES, TEMPERATURES)
    return tour_actions(moves_of(instance), anneal(instance, seed, moves, order, *temperatures)[1])


def rest_of(
    before: RoutingProblem, plan: Plan, problem: RoutingProblem
) -> tuple[tuple[Visit, ...] | None, float]:
    """Return the rest of an earlier plan and a lower bound on tour lengths in metres, for a later state of a task.

    The rest is None if other visits are left or an object was moved. A tour of the earlier state can make the visits
    that are done by now, and then follow any tour of the later state. So the earlier bound less the length of this way
    also holds for the later state. It allows for legs that became shorter because an object was moved.
    """
    visits = problem.visits
    left = set(visits)
    done = [visit for visit in plan.visits if visit not in left]
    possible = all(visit in possible_next(before, done[:k]) for k, visit in enumerate(done))
    if not left or not possible or len(done) + len(left) != len(plan.visits):
        return None, 0.0
    here, there = problem.stops(visits)[1:], before.stops(visits)[1:]
    legs, old_legs = problem.distances[np.ix_(here, here)], before.distances[np.ix_(there, there)]
    way = before.distances[before.stops(done)[-1], there] - problem.distances[problem.start, here]
    shorter = (len(left) - 1) * (old_legs - legs).max()
    rest = plan.visits[len(done) :]
    follows = set(rest) == left and np.allclose(legs, old_legs, rtol=0.0, atol=SAME)
    lower = plan.lower_bound - tour_length(before, done) - way.max() - shorter
    return rest if follows else None, float(lower)
