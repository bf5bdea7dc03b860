"""The exact planner for a capacity of one or two and up to 60 objects. OR-Tools solves other problems."""

import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

from planner.exact.cuts.graph import LONGEST
from planner.exact.full_table import SMALL_TABLE, by_table, full_table_bytes
from planner.exact.instance import MAX_SEARCHED, Instance, make_instance, to_visits
from planner.exact.table import BIN_ROWS, Solution, longest
from planner.exact.warm_start import Start, WarmStart
from planner.plan import Plan
from planner.problem import RoutingProblem, make_plan, tour_length
from planner.solvers import Deadline, SolveLimit

DEFAULT_WORK = 4_000_000  # default number of states to expand, which takes about 4 s including tables
MAX_OBJECTS = 60
MAX_ARCS = 40_000  # approximate maximum number of arcs for branch and cut, which may need minutes and 1 GB
# Limits of each pass of the search: number of rows in the bound's table, and number of states kept per layer
TABLE_ROWS = (600, 2_500, 8_000, 16_000, BIN_ROWS, 1 << 17, 1 << 19, 1 << 20)
WIDTHS = (1_500, 8_000, 20_000, 60_000, 60_000, 200_000, 1_000_000, 3_000_000)


@dataclass(frozen=True)
class ExactSolver:
    """A planner that finds optimal tours with a full table, a beam search, or branch and cut, by number of objects.

    `SolveLimit.work` is the maximum number of states that the search expands. It does not limit full tables. Branch and
    cut counts each round and each node as the number of states that are expanded in the same time.

    Attributes:
        name: Name of the planner in run records.
        table_bytes: Maximum size of a full table in bytes. A value of 0 disables full tables.
        most_searched: Number of objects above which branch and cut replaces the beam search.
        passes: Limits of each pass of the search.
    """

    name: str = "exact"
    table_bytes: int = 1 << 27  # enough for 18 objects and 6 bins, which takes 0.1 s
    most_searched: int = 24
    passes: tuple[tuple[int, int], ...] = tuple(zip(TABLE_ROWS, WIDTHS, strict=True))

    def solve(self, problem: RoutingProblem, *, seed: int = 0, limit: SolveLimit | None = None) -> Plan:
        """Solve a problem. The plan is OPTIMAL if proven, and otherwise FEASIBLE with the best known bound.

        The default limit is 4 million states. If OR-Tools solves the problem, `limit.work` does not apply.
        """
        *_, best = self._plans(problem, seed, limit or SolveLimit(), at_once=True)
        return best

    def improve(
        self,
        problem: RoutingProblem,
        *,
        seed: int = 0,
        limit: SolveLimit | None = None,
        warm: WarmStart | None = None,
    ) -> Iterator[Plan]:
        """Yield a first plan from annealing, then every plan with a shorter tour or a better bound.

        With a warm start, the first plan comes from a narrow search and is usually better. The last plan can
        differ from the result of `solve` if it is not proven optimal or if there are several optimal plans.
        """
        best = None
        for plan in self._plans(problem, seed, limit or SolveLimit(), at_once=False, warm=warm):
            if best is None or plan.improves_on(best):
                best = plan
                yield plan

    def applies(self, problem: RoutingProblem) -> bool:
        return not self.why_not(problem)

    def why_not(self, problem: RoutingProblem) -> str:
        """Return the reason why this planner cannot solve a problem itself, or an empty string."""
        if problem.capacity > 2:
            return f"the capacity of {problem.capacity} is above 2"
        if len(problem.shipments) > MAX_OBJECTS:
            return f"{len(problem.shipments)} shipments are more than {MAX_OBJECTS}"
        bins = {s.delivery for s in problem.shipments} | set(problem.onboard)
        if len(problem.shipments) > MAX_SEARCHED and len(problem.shipments) * len(bins) ** 2 > MAX_ARCS:
            return f"{len(problem.shipments)} shipments are more than {MAX_SEARCHED} and have too many bins"
        return "" if problem.integers.is_metric else "the distances break the triangle inequality"

    def tabled(self, problem: RoutingProblem) -> Instance | None:
        """Return the arrays of a problem that a full table can solve, or None for other problems."""
        instance = make_instance(problem, problem.integers.metric) if self.applies(problem) else None
        return instance if instance is not None and full_table_bytes(instance) <= self.table_bytes else None

    def _plans(
        self,
        problem: RoutingProblem,
        seed: int,
        limit: SolveLimit,
        *,
        at_once: bool,
        warm: WarmStart | None = None,
    ) -> Iterator[Plan]:
        """Yield a series of plans. If `at_once`, only the last one counts."""
        if not self.applies(problem):
            from planner.ortools_solver import OrToolsSolver  # imported here because it is slow to import

            other, limit = OrToolsSolver(), replace(limit, work=None)
            yield from [other.solve(problem, limit=limit)] if at_once else other.improve(problem, limit=limit)
            return
        started = time.perf_counter()
        metric = problem.integers.metric
        instance = make_instance(problem, metric)
        size = full_table_bytes(instance)
        tabled = size <= self.table_bytes
        n = len(problem.shipments)
        if tabled and ((at_once and limit.seconds is None) or size <= SMALL_TABLE):
            found: Iterable[Solution] = by_table(instance)
        else:
            start = None if warm is None else warm.numbered(problem.names[:n], instance.unit)
            found = self._search(instance, seed, limit, started, tabled=tabled, start=start)
        for solution in found:
            visits = to_visits(instance, solution.actions, problem.names[:n], problem.names[n:])
            length = tour_length(problem, visits, metric)
            yield make_plan(problem, visits, length, solution.bound, started, solution.certificate)

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
        from planner.exact.search import improving_tours  # imported here because it takes 0.5 s to import

        deadline = Deadline.of(limit, started)
        work, cut = limit.work or DEFAULT_WORK, not tabled and self.uses_cuts(instance)
        passes = () if tabled or cut else self.passes
        for solution in improving_tours(instance, seed, work, deadline, passes, start):
            yield solution
        if tabled:
            yield from by_table(instance, deadline)
        elif cut and not deadline.over():
            # Imported here because it loads MathOpt.
            from planner.exact.cuts.branch_and_cut import tours_by_cuts

            yield from tours_by_cuts(instance, seed, work, deadline, solution)

    def uses_cuts(self, instance: Instance) -> bool:
        """Return True if branch and cut should solve an instance.

        With up to 40 objects, it is only used if its distances are exact enough to prove that a tour is shortest.
        """
        n, m = instance.to_bin.shape
        exact = instance.tie == 0 and longest(instance) <= LONGEST
        return n > MAX_SEARCHED or (n > self.most_searched and exact and n * m * m <= MAX_ARCS)
