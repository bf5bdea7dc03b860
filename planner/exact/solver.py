"""The exact planner: for capacity two up to 40 objects; for other capacities while they are few."""

import math
import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.exact.annealing import anneal, tour_actions
from planner.exact.beam import beam_pass
from planner.exact.deadline import Deadline
from planner.exact.general import best_first
from planner.exact.instance import Instance, make_instance, to_visits
from planner.exact.multipliers import first_bound, grown
from planner.exact.relaxation import fill, new_table, walk
from planner.ortools_solver import OrToolsSolver
from planner.plan import Plan
from planner.problem import RoutingProblem
from planner.solver import SolveLimit
from planner.tour import integer_distances, integer_metric, is_metric, make_plan

TABLE_RATE = 250e6  # bytes of a full table filled per second, roughly
ANNEALING_MOVES = 20_000
DEFAULT_WORK = 8_000_000  # states: some 5 s
GENERAL_STATES = 60_000  # of the search for any capacity: some 10 objects, 1 s
LONGEST = 1 << 27  # units; tours beyond this would overflow 32 bits


@dataclass(frozen=True)
class ExactSolver:
    """Full table, or annealing and a widening layered search, until proven or out of budget.

    A limit on work counts expanded states of the search; the full table is always finished.

    Attributes:
        name: Name in run records.
        table_bytes: Largest full table; 0 always searches.
        passes: Objects kept exactly by the bound and states kept of each layer, from pass to pass.
    """

    name: str = "exact"
    table_bytes: int = 1 << 26  # 18 objects and 6 bins: 0.2 s
    passes: tuple[tuple[int, int], ...] = (
        (2, 3_000),
        (6, 6_000),
        (8, 30_000),
        (11, 150_000),
        (13, 500_000),
    )

    def solve(self, problem: RoutingProblem, *, seed: int = 0, limit: SolveLimit | None = None) -> Plan:
        """Plan the rest of a task.

        Args:
            problem: What is left to do.
            seed: Of the annealing.
            limit: States or seconds; by default 8 million states. OR-Tools counts other things, so only the
                seconds are handed on to it.

        Returns:
            OPTIMAL where proven, else FEASIBLE with the best bound so far.
        """
        started = time.perf_counter()
        limit = limit or SolveLimit()
        metric = integer_metric(problem.distances)
        n = len(problem.shipments)
        special = problem.capacity != 2 or n > 40 or int(metric.max()) * (2 * n + 2) > LONGEST
        if special or not is_metric(problem.distances, metric):
            return self._general(problem, metric, seed, limit, started)
        instance = make_instance(problem, metric)
        size = _table_bytes(instance)
        if size <= min(self.table_bytes, math.inf if limit.seconds is None else limit.seconds * TABLE_RATE):
            actions, bound = _by_table(instance)
        else:
            actions, bound = self._search(instance, seed, limit, started)
        return make_plan(problem, metric, to_visits(problem, instance, actions), bound, started)

    def _general(
        self, problem: RoutingProblem, metric: NDArray[np.int64], seed: int, limit: SolveLimit, started: float
    ) -> Plan:
        """Any capacity and any distances: proven for a few objects, else OR-Tools with the bound reached."""
        legs = metric if is_metric(problem.distances, metric) else integer_distances(problem.distances)
        found = best_first(problem, legs, metric, GENERAL_STATES)
        visits = found.visits
        if visits is None:
            plan = OrToolsSolver().solve(problem, seed=seed, limit=SolveLimit(seconds=limit.seconds))
            visits = list(plan.visits)
        return make_plan(problem, legs, visits, found.bound, started)

    def _search(
        self, instance: Instance, seed: int, limit: SolveLimit, started: float
    ) -> tuple[list[int], int]:
        """Actions of the best tour found, and a lower bound in units."""
        deadline = Deadline(None if limit.seconds is None else started + limit.seconds)
        work = limit.work or DEFAULT_WORK
        upper, order = anneal(instance, seed, ANNEALING_MOVES)
        upper = int(upper)
        actions: list[int] = tour_actions(instance, order).tolist()
        bound = first_bound(instance, upper)
        lower = bound.root
        done = 0
        for size, wanted in self.passes:
            # A pass expands about n / 2 times its width. Cut below the last one's, it would hardly help.
            width = min(wanted, work // max(1, len(instance.home) // 2))
            if lower >= upper or width < min(wanted, done + 1) or deadline.over():
                break
            bound = grown(bound, upper, size, deadline)
            result = beam_pass(bound, upper, width, work, deadline)
            work -= result.expanded
            done = width
            lower = max(lower, bound.root, result.lower)
            if result.actions is not None:
                upper, actions = result.upper, result.actions
        return actions, min(lower, upper)


def _table_bytes(instance: Instance) -> int:
    n, m = len(instance.home), len(instance.bins)
    return 4 * (m * m + n) << n


def _by_table(instance: Instance) -> tuple[list[int], int]:
    table = new_table(instance, len(instance.home))
    fill(instance, table)
    actions: NDArray[np.int64] = np.empty(2 * len(instance.home) + 2, np.int64)
    length, count = walk(instance, table, actions)
    return actions[:count].tolist(), int(length)
