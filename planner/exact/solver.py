"""The exact planner for a capacity of one or two and up to 40 objects. OR-Tools solves other problems."""

import math
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

from planner.exact.full_table import SMALL_TABLE, by_table, full_table_bytes
from planner.exact.instance import Instance, make_instance, to_visits
from planner.exact.table import BIN_ROWS, Solution
from planner.exact.warm_start import Start, WarmStart
from planner.plan import Plan
from planner.problem import RoutingProblem, make_plan
from planner.solvers import Deadline, SolveLimit

TABLE_RATE = 500e6  # approximate speed at which a full table is filled, in bytes per second
DEFAULT_WORK = 4_000_000  # default number of states to expand, about 4 s including tables
MAX_OBJECTS = 40


@dataclass(frozen=True)
class ExactSolver:
    """Planner that uses a full table, or annealing and a search, until the plan is proven or the budget is spent.

    `SolveLimit.work` counts the states that the search expands. A full table is always finished.

    Attributes:
        name: Name in run records.
        table_bytes: Maximum size of a full table in bytes. 0 disables full tables.
        passes: For each pass, the maximum number of table rows of the bound and of states kept per layer.
    """

    name: str = "exact"
    table_bytes: int = 1 << 27  # enough for 18 objects and 6 bins, filled in 0.1 s
    passes: tuple[tuple[int, int], ...] = (
        (600, 1_500),
        (2_500, 8_000),
        (8_000, 20_000),
        (16_000, 60_000),
        (BIN_ROWS, 60_000),
        (1 << 17, 200_000),
        (1 << 19, 1_000_000),
        (1 << 20, 3_000_000),
    )

    def solve(self, problem: RoutingProblem, *, seed: int = 0, limit: SolveLimit | None = None) -> Plan:
        """Solve a problem. The plan is OPTIMAL if proven, else FEASIBLE with the best known bound.

        The default limit is 4 million states. `limit.work` is not passed to OR-Tools, which counts other work.
        """
        limit = limit or SolveLimit()
        if not self.applies(problem):
            from planner.ortools_solver import OrToolsSolver  # imported late, because it is slow to import

            return OrToolsSolver().solve(problem, limit=replace(limit, work=None))
        *_, best = self._plans(problem, seed, limit, table_at_once=True)
        return best

    def improve(
        self,
        problem: RoutingProblem,
        *,
        seed: int = 0,
        limit: SolveLimit | None = None,
        warm: WarmStart | None = None,
    ) -> Iterator[Plan]:
        """Yield the annealed tour with a first bound, then every shorter tour or better bound.

        With a warm start, the first plan comes from a narrow search and is better. The last plan can differ from the
        result of `solve` if it is not proven or if there are several optimal plans.
        """
        limit = limit or SolveLimit()
        if not self.applies(problem):
            from planner.ortools_solver import OrToolsSolver

            yield from OrToolsSolver().improve(problem, limit=replace(limit, work=None))
            return
        best = None
        for plan in self._plans(problem, seed, limit, table_at_once=False, warm=warm):
            if best is None or plan.improves_on(best):
                best = plan
                yield plan

    def applies(self, problem: RoutingProblem) -> bool:
        return not self.why_not(problem)

    def why_not(self, problem: RoutingProblem) -> str:
        """Return the reason why only OR-Tools can solve the problem, or an empty string."""
        if problem.capacity > 2:
            return f"the capacity of {problem.capacity} is above 2"
        if len(problem.shipments) > MAX_OBJECTS:
            return f"{len(problem.shipments)} shipments are more than {MAX_OBJECTS}"
        return "" if problem.integers.is_metric else "the distances break the triangle inequality"

    def table_fits(self, instance: Instance) -> bool:
        return full_table_bytes(instance) <= self.table_bytes

    def _plans(
        self,
        problem: RoutingProblem,
        seed: int,
        limit: SolveLimit,
        *,
        table_at_once: bool,
        warm: WarmStart | None = None,
    ) -> Iterator[Plan]:
        """Yield successively better plans, or only one if a table is filled at once."""
        started = time.perf_counter()
        metric = problem.integers.metric
        instance = make_instance(problem, metric)
        seconds = math.inf if limit.seconds is None else limit.seconds
        size = full_table_bytes(instance)
        tabled = size <= min(self.table_bytes, seconds * TABLE_RATE)
        n = len(problem.shipments)
        if tabled and (table_at_once or size <= SMALL_TABLE):
            found: Iterable[Solution] = [by_table(instance)]
        else:
            start = None if warm is None else warm.numbered(problem.names[:n], instance.unit)
            found = self._search(instance, seed, limit, started, tabled=tabled, start=start)
        for solution in found:
            visits = to_visits(instance, solution.actions, problem.names[:n], problem.names[n:])
            yield make_plan(problem, metric, visits, solution.bound, started, solution.certificate)

    def _search(
        self,
        instance: Instance,
        seed: int,
        limit: SolveLimit,
        started: float,
        *,
        tabled: bool,
        start: Start | None,
    ) -> Iterator[Solution]:
        """Yield the annealed tour, then the result of the full table or those of the search."""
        from planner.exact.search import improving_tours  # imported late, because kernels take 0.5 s to load

        deadline = Deadline(None if limit.seconds is None else started + limit.seconds, limit.stop)
        passes = () if tabled else self.passes
        yield from improving_tours(instance, seed, limit.work or DEFAULT_WORK, deadline, passes, start)
        if tabled and not deadline.over():
            yield by_table(instance)
