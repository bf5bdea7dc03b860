"""The exact planner: for capacity two up to 40 objects; for other capacities while they are few."""

import math
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from planner.certificate import Certificate, Proof
from planner.errors import ProblemError
from planner.exact.annealing import anneal, anneal_from, tour_actions
from planner.exact.beam import beam_pass
from planner.exact.deadline import Deadline
from planner.exact.general import best_first
from planner.exact.groups import alone
from planner.exact.instance import Instance, make_instance, to_visits
from planner.exact.multipliers import Bound, first_bound, grown, told_apart
from planner.exact.relaxation import fill, new_table, table_bytes, walk
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
WARM_MOVES, WARM_ROWS, WARM_WIDTH = 3_000, 1 << 14, 800
WARM_TEMPERATURES = (0.1, 0.02)  # mean legs
DEFAULT_WORK = 4_000_000  # states: some 4 s with the tables, for what is planned again and again
BIN_ROWS = 50_000  # of a table that counts by bin: 30 objects and 6 bins
GENERAL_STATES = 60_000  # of the search for any capacity: some 10 objects, 1 s
PROVABLE = 14  # objects; with more of them that search has no hope
LONGEST = 1 << 27  # units; tours beyond this would overflow 32 bits


@dataclass(frozen=True)
class ExactSolver:
    """Full table, or annealing and a widening layered search, until proven or out of budget.

    A limit on work counts expanded states of the search; the full table is always finished.

    Attributes:
        name: Name in run records.
        table_bytes: Largest full table; 0 always searches.
        passes: Rows of the bound's table and states kept of each layer, at most, from pass to pass.
    """

    name: str = "exact"
    table_bytes: int = 1 << 26  # 18 objects and 6 bins: 0.2 s
    passes: tuple[tuple[int, int], ...] = (
        (1, 3_000),
        (1_000, 20_000),
        (16_000, 60_000),
        (BIN_ROWS, 60_000),
        (1 << 17, 200_000),
        (1 << 18, 1_000_000),
        (1 << 19, 2_000_000),
    )

    def solve(self, problem: RoutingProblem, *, seed: int = 0, limit: SolveLimit | None = None) -> Plan:
        """Plan the rest of a task.

        Args:
            problem: What is left to do.
            seed: Of the annealing.
            limit: States or seconds; by default 4 million states. OR-Tools counts other things, so only the
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
        # Time for a proof where there is hope of one; the rest for a tour.
        share = 0.5 if len(problem.shipments) <= PROVABLE else 0.05
        at = None if limit.seconds is None else started + limit.seconds * share
        found = best_first(problem, legs, metric, GENERAL_STATES, Deadline(at, limit.stop))
        certificate = Certificate(Proof.EXHAUSTIVE, found.bound)
        visits, other = found.visits, None
        if visits is None:
            from planner.ortools_solver import OrToolsSolver  # loaded only where it is needed

            left = (
                None if limit.seconds is None else max(0.001, started + limit.seconds - time.perf_counter())
            )
            other = OrToolsSolver().solve(problem, seed=seed, limit=SolveLimit(seconds=left))
            visits = list(other.visits)
        plan = make_plan(problem, legs, visits, found.bound, started, certificate)
        if other is not None and other.lower_bound > plan.lower_bound:
            return replace(other, seconds=plan.seconds)
        return plan

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
            bound = warm_bound(instance, warm.certificate, WARM_ROWS)
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
        for rows, wanted in self.passes:
            # A pass given up proves nothing, and one hardly wider than the last one little.
            width = min(wanted, work // rate)
            if lower >= upper or width < min(wanted, done + 1) or deadline.over():
                break
            if rows >= BIN_ROWS:
                bound = told_apart(bound, upper, BIN_ROWS, deadline)
            bound = grown(bound, upper, rows, deadline)
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
    table = bound.table
    groups = tuple(tuple(np.flatnonzero(table.group == g).tolist()) for g in range(len(table.size)))
    return Certificate(Proof.RELAXATION, bound.root, groups, tuple(table.multipliers.tolist()))


def _table_bytes(instance: Instance) -> int:
    return table_bytes(instance, 1 << len(instance.home))


def _by_table(instance: Instance) -> _Found:
    table = new_table(instance, alone(len(instance.home)))
    fill(instance, table)
    actions: NDArray[np.int64] = np.empty(2 * len(instance.home) + 2, np.int64)
    length, count = walk(instance, table, actions)
    return actions[:count].tolist(), int(length), Certificate(Proof.FULL_TABLE, int(length))
