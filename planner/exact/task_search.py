"""Search for plans of successive task states. All searches together expand a limited number of states."""

import math
import time
from dataclasses import replace

from planner.exact.instance import Instance, make_instance, to_visits
from planner.exact.solver import ExactSolver
from planner.exact.table import Solution
from planner.exact.warm_start import NOTHING_KNOWN, Start
from planner.plan import Plan, Proof, Status
from planner.problem import RoutingProblem, make_plan, tour_length
from planner.solvers import Deadline, SolveLimit

TASK_WORK = 3_000_000  # default number of states that all searches of a task expand together
TABLE_OBJECTS = 18  # number of objects from which on a full table replaces the searches
PAUSE = 2  # number of picks after which the search is repeated if the last one proved nothing
HURRIED_ROWS = 600  # maximum number of rows in a table that is filled after the search was stopped
SEARCHES = 2  # number of searches per object, one after it is picked up and one after it is placed
# Annealing of an earlier tour with more than 24 objects, and the number of rows in the table that bounds it
MOVES, TEMPERATURES, ROWS = 20_000, (0.05, 0.01), 600


class TaskSearch:
    """A search that is repeated for successive states of a task, and expands a limited number of states in total.

    Each search may use an equal share of the remaining states, so that early searches, which are the hardest
    ones, leave states for later ones. After a search without a proof, two objects must be picked up before the
    next one. A search without multipliers of an earlier plan may use half of the states, because its
    multipliers serve all later searches. Without states, a plan results from annealing and these multipliers.
    Results are reproducible unless `limit` contains a time or a stop event.

    With more than 24 objects, the last tour is annealed, and fitted multipliers bound it. `limit.work` does not apply.

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
        self._began_by_cuts = False
        self._most = math.inf  # number of loose objects up to which a proof seems possible

    def applies(self, problem: RoutingProblem) -> bool:
        return self._solver.applies(problem)

    def learn(self, problem: RoutingProblem, plan: Plan) -> None:
        """Use the order of a plan for this problem, and its multipliers if it has any, in later searches."""
        self._warm = self._warm.updated(problem, plan)
        self._began_by_cuts |= plan.certificate is not None and plan.certificate.proof is Proof.CUTS

    def by_cuts(self, problem: RoutingProblem) -> bool:
        """Return True if a problem is too large for searches, so that only a first plan may be proven."""
        applies = self._solver.applies(problem)
        return applies and self._solver.uses_cuts(make_instance(problem, problem.integers.metric))

    def continues(self, problem: RoutingProblem) -> bool:
        """Return True if shown plans reuse earlier results, because the task began with too many objects."""
        if not self._solver.applies(problem) or not self._began_by_cuts:
            return self.by_cuts(problem)
        return not self._solver.table_fits(make_instance(problem, problem.integers.metric))

    def start(self, problem: RoutingProblem, instance: Instance) -> Start | None:
        """Return a warm start for a problem, or None if nothing is known about its objects."""
        return self._warm.numbered(problem.names[: len(problem.shipments)], instance.unit)

    def share(self, problem: RoutingProblem) -> int:
        """Return the number of states that a search for this problem may expand."""
        if self.by_cuts(problem):
            return 0
        if not self._warm.multipliers:
            return self.left // 2
        if len(problem.shipments) > self._most:
            return 0
        return self.left // (SEARCHES * max(1, len(problem.shipments) - TABLE_OBJECTS))

    def spend(self, states: int) -> None:
        self.left = max(0, self.left - states)

    def plan(self, problem: RoutingProblem, *, seed: int = 0, limit: SolveLimit | None = None) -> Plan:
        """Return the best plan within the share of this problem, to which the solver must apply."""
        started, metric = time.perf_counter(), problem.integers.metric
        instance, n = make_instance(problem, metric), len(problem.shipments)
        by_cuts, stopped = self.by_cuts(problem), limit is not None and limit.stopped
        work = 0 if stopped else self.share(problem)
        if by_cuts:
            best = self._bounded(problem, instance, seed, Deadline.of(limit))
        else:
            from planner.exact.search import WARM_ROWS, improving_tours  # this import takes 0.5 s

            rows, start = HURRIED_ROWS if stopped else WARM_ROWS, self.start(problem, instance)
            passes, end = self._solver.passes, Deadline.of(limit)
            *_, best = improving_tours(instance, seed, work, end, passes, start, rows)
            self.spend(best.expanded)
        visits = to_visits(instance, best.actions, problem.names[:n], problem.names[n:])
        length = tour_length(problem, visits, metric)
        plan = make_plan(problem, visits, length, best.bound, started, best.certificate)
        if work and plan.status is not Status.OPTIMAL:
            self._most = min(self._most, n - PAUSE)
        is_better = plan.status is Status.OPTIMAL or not self._warm.multipliers
        self.learn(problem, plan if is_better and not by_cuts else replace(plan, certificate=None))
        return plan

    def _bounded(self, problem: RoutingProblem, instance: Instance, seed: int, end: Deadline) -> Solution:
        from planner.exact.annealing import anneal, completed, tour_actions
        from planner.exact.moves import moves_of
        from planner.exact.multipliers import first_bound, grown

        order = completed(instance, self._warm.indices(problem.names[: len(problem.shipments)]))
        length, order = anneal(instance, seed, MOVES, order, *TEMPERATURES)
        bound = grown(first_bound(instance, length), length, ROWS, end)
        return Solution(tour_actions(moves_of(instance), order), min(bound.root, length), bound.certificate)
