"""The exact planner: for capacity two up to 40 objects; for other capacities while they are few."""

import math
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.certificate import Certificate, Proof
from planner.errors import ProblemError
from planner.exact.annealing import anneal, anneal_from, tour_actions
from planner.exact.beam import beam_pass
from planner.exact.deadline import Deadline
from planner.exact.general import best_first
from planner.exact.instance import Instance, make_instance, to_visits
from planner.exact.multipliers import Bound, first_bound, grown
from planner.exact.relaxation import fill, new_table, walk
from planner.exact.warm import Warm, warm_bound, warm_order
from planner.greedy_solver import GreedySolver
from planner.plan import Plan
from planner.problem import RoutingProblem
from planner.solver import SolveLimit
from planner.tour import integer_distances, integer_metric, is_metric, make_plan

TABLE_RATE = 250e6  # bytes of a full table filled per second, roughly
SMALL_TABLE = 1 << 22  # bytes; filled in some 20 ms, so there is no need of a plan before it
ANNEALING_MOVES = 20_000
# A first plan with something known: some 20 ms.
WARM_MOVES, WARM_EXACT, WARM_WIDTH = 3_000, 8, 800
WARM_TEMPERATURES = (0.1, 0.02)  # mean legs
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
        for plan in self._plans(problem, seed, limit or SolveLimit(), table_at_once=True):
            best = plan
        return best

    def improve(
        self,
        problem: RoutingProblem,
        *,
        seed: int = 0,
        limit: SolveLimit | None = None,
        warm: Warm | None = None,
    ) -> Iterator[Plan]:
        """Yield the annealed tour with a first bound, then each shorter tour or better bound.

        Args:
            problem: What is left to do.
            seed: Of the annealing.
            limit: As in `solve`.
            warm: What is known from a similar problem. The first plan is then that of a narrow search with it,
                which is better; the last may differ from that of `solve` where it is not proven, or ties.

        Raises:
            ProblemError: What is known is about another number of shipments.
        """
        if warm is not None and len(warm.order) != len(problem.shipments):
            raise ProblemError(
                f"known are {len(warm.order)} shipments, the problem has {len(problem.shipments)}"
            )
        best = None
        for plan in self._plans(problem, seed, limit or SolveLimit(), table_at_once=False, warm=warm):
            if best is None or plan.improves_on(best):
                best = plan
                yield plan

    def applies(self, problem: RoutingProblem, metric: NDArray[np.int64]) -> bool:
        """Whether table and search apply: capacity two, up to 40 objects, true distances; `metric` is their closure."""
        n = len(problem.shipments)
        small = n <= 40 and int(metric.max()) * (2 * n + 2) <= LONGEST
        return problem.capacity == 2 and small and is_metric(problem.distances, metric)

    def table_fits(self, instance: Instance) -> bool:
        """Whether the full table is small enough."""
        return _table_bytes(instance) <= self.table_bytes

    def _plans(
        self,
        problem: RoutingProblem,
        seed: int,
        limit: SolveLimit,
        *,
        table_at_once: bool,
        warm: Warm | None = None,
    ) -> Iterator[Plan]:
        """Ever better plans; only one where a table is filled at once."""
        started = time.perf_counter()
        metric = integer_metric(problem.distances)
        if not self.applies(problem, metric):
            if not table_at_once:
                yield GreedySolver().solve(problem)
            yield self._general(problem, metric, seed, limit, started)
            return
        instance = make_instance(problem, metric)
        seconds = math.inf if limit.seconds is None else limit.seconds
        size = _table_bytes(instance)
        by_table = size <= min(self.table_bytes, seconds * TABLE_RATE)
        if by_table and (table_at_once or size <= SMALL_TABLE):
            found: Iterable[_Found] = [_by_table(instance)]
        else:
            found = self._search(instance, seed, limit, started, by_table=by_table, warm=warm)
        for actions, bound, certificate in found:
            visits = to_visits(problem, instance, actions)
            yield make_plan(problem, metric, visits, bound, started, certificate)

    def _general(
        self, problem: RoutingProblem, metric: NDArray[np.int64], seed: int, limit: SolveLimit, started: float
    ) -> Plan:
        """Any capacity and any distances: proven for a few objects, else OR-Tools with the bound reached."""
        legs = metric if is_metric(problem.distances, metric) else integer_distances(problem.distances)
        found = best_first(problem, legs, metric, GENERAL_STATES)
        visits = found.visits
        if visits is None:
            from planner.ortools_solver import OrToolsSolver  # loaded only where it is needed

            plan = OrToolsSolver().solve(problem, seed=seed, limit=SolveLimit(seconds=limit.seconds))
            visits = list(plan.visits)
        certificate = Certificate(Proof.EXHAUSTIVE, found.bound)
        return make_plan(problem, legs, visits, found.bound, started, certificate)

    def _search(
        self,
        instance: Instance,
        seed: int,
        limit: SolveLimit,
        started: float,
        *,
        by_table: bool,
        warm: Warm | None,
    ) -> Iterator["_Found"]:
        """Ever better tours and bounds: annealed, then by the full table or by passes of the search."""
        deadline = Deadline(None if limit.seconds is None else started + limit.seconds, limit.stop)
        work = limit.work or DEFAULT_WORK
        if warm is None:
            upper, order = anneal(instance, seed, ANNEALING_MOVES)
            bound = first_bound(instance, int(upper))
        else:
            first = warm_order(instance, warm)
            upper, order = anneal_from(instance, seed, WARM_MOVES, first, *WARM_TEMPERATURES)
            bound = warm_bound(instance, warm.certificate, WARM_EXACT)
        upper, lower = int(upper), bound.root
        actions: list[int] = tour_actions(instance, order).tolist()
        if warm is not None:
            narrow = beam_pass(bound, upper, WARM_WIDTH, work, Deadline(None))
            lower = max(lower, narrow.lower)
            if narrow.actions is not None:
                upper, actions = narrow.upper, narrow.actions
        yield actions, min(lower, upper), _certificate(bound)
        if by_table:
            if not deadline.over():
                yield _by_table(instance)
            return
        done, rate = 0, max(1, len(instance.home) // 2)
        for size, wanted in self.passes:
            # A pass given up proves nothing, and one hardly wider than the last one little.
            width = min(wanted, work // rate)
            if lower >= upper or width < min(wanted, done + 1) or deadline.over():
                break
            bound = grown(bound, upper, size, deadline)
            result = beam_pass(bound, upper, width, work, deadline)
            work -= result.expanded
            done, rate = width, max(1, -(-result.expanded // width))  # a wider pass expands fewer per width
            lower = max(lower, bound.root, result.lower)
            if result.actions is not None:
                upper, actions = result.upper, result.actions
            yield actions, min(lower, upper), _certificate(bound)


# Actions of a tour, a lower bound in units, and what proves it.
_Found = tuple[list[int], int, Certificate]


def _certificate(bound: Bound) -> Certificate:
    prices = [0] * len(bound.order)
    for k, price in zip(bound.order, bound.table.multipliers.tolist(), strict=True):
        prices[k] = price
    return Certificate(Proof.RELAXATION, bound.root, bound.order[: bound.table.s], tuple(prices))


def _table_bytes(instance: Instance) -> int:
    n, m = len(instance.home), len(instance.bins)
    return 4 * (m * m + n) << n


def _by_table(instance: Instance) -> _Found:
    table = new_table(instance, len(instance.home))
    fill(instance, table)
    actions: NDArray[np.int64] = np.empty(2 * len(instance.home) + 2, np.int64)
    length, count = walk(instance, table, actions)
    return actions[:count].tolist(), int(length), Certificate(Proof.FULL_TABLE, int(length))
