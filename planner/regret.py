"""Compute the regrets of visits, which are the extra tour lengths compared with the best next visit."""

import math
from dataclasses import dataclass, field, replace

from planner.errors import ProblemError
from planner.exact.full_table import TaskTable
from planner.exact.instance import make_instance
from planner.exact.moves import moves_of
from planner.exact.multipliers import Bound, first_bound, grown, warm_bound
from planner.exact.solver import ExactSolver
from planner.exact.table_regret import Costs, costs_by_pass, costs_in
from planner.exact.task_search import TaskSearch
from planner.geodesics import Geodesics
from planner.plan import Plan, Status, Visit
from planner.problem import RoutingProblem, after, is_for, possible_next, same_problem, tour_length
from planner.route import TaskState
from planner.solvers import Deadline, SolveLimit, Solver
from planner.task_problems import TaskProblems

RADIUS = 1.0  # default limit up to which regrets are computed exactly, in metres
MIN_RADIUS = 0.1  # smallest radius of a pass in metres
MAX_ROWS = 1 << 14  # maximum number of rows in the lower-bound table of a pass
MAX_STATES = 3_000_000  # maximum number of states in a pass, which occupy about 200 MB


@dataclass(frozen=True)
class Regret:
    """The regret of a possible next visit."""

    visit: Visit
    cost: float  # length of the remaining tour in metres if this visit is next
    regret: float  # extra length in metres compared with the best visit
    proven: bool  # True if cost and regret are proven values, or proven bounds if `capped`
    capped: bool = False  # True if cost and regret are only lower bounds


@dataclass(frozen=True)
class RegretBounds:
    """Proven bounds on the regret of a visit in metres."""

    lower: float
    upper: float
    exact: float | None  # the regret, or None if it is not proven


@dataclass(eq=False)
class RegretEvaluator:
    """An evaluator that computes the regrets of visits with the exact planner.

    `limit` applies to searches with more than 18 remaining objects. All of them together expand at most
    `limit.work` states, or 3 million by default. Results are reproducible unless time is limited. `all`
    computes regrets of up to `radius` metres exactly.
    """

    geodesics: Geodesics
    solver: ExactSolver = field(default_factory=ExactSolver)
    capacity: int = 2
    limit: SolveLimit | None = None
    radius: float = RADIUS
    search: TaskSearch | None = None

    def __post_init__(self) -> None:
        self._search = self.search or TaskSearch(self.solver, self.limit)
        self._problems = TaskProblems(self.geodesics, self.capacity)
        self._table = TaskTable(self.solver.tabled)
        self._last: tuple[TaskState, dict[Visit, Regret]] | None = None
        # Problem of the last state, and the plan for it
        self._planned: tuple[RoutingProblem, Plan] | None = None

    def limited(self, limit: SolveLimit) -> "RegretEvaluator":
        """Return a copy for another thread, with a limit on each search. It shares the budget of this evaluator."""
        return replace(self, limit=limit, search=self._search)

    def all(self, state: TaskState, plan: Plan | None = None) -> dict[Visit, Regret]:
        """Return the regret of each possible next visit, starting with the best visit.

        `plan` is a plan for this state or for an earlier one. A proven plan for this state saves a search.
        Raises UnreachableError if objects cannot be fetched or delivered.
        """
        if self._last is None or not same_state(self._last[0], state):
            problem = self._problems.problem(state)
            found = regrets(
                problem,
                self.solver,
                limit=self.limit,
                radius=self.radius,
                plan=plan if plan is not None and is_for(plan, problem) else None,
                table=self._table,
                search=self._search,
            )
            self._last = state, {regret.visit: regret for regret in found}
        return dict(self._last[1])

    def of(self, state: TaskState, visit: Visit, plan: Plan | None = None) -> float | None:
        """Return the exact regret of a visit in metres, or None if no exact regret is available.

        `plan` is a plan for this state or an earlier one, or None. Raises UnreachableError if objects cannot be fetched
        or delivered.
        """
        bounds = self.bounds(state, visit, plan)
        return None if bounds is None else bounds.exact

    def bounds(self, state: TaskState, visit: Visit, plan: Plan | None = None) -> RegretBounds | None:
        """Return bounds on the regret of a visit, or None if the visit is not possible.

        The arguments and errors are those of `of`.
        """
        if self._last is not None and same_state(self._last[0], state):
            known = self._last[1].get(visit)
            if known is not None and known.proven and not known.capped:
                return RegretBounds(known.regret, known.regret, known.regret)
        problem = self._problems.problem(state)
        if visit not in possible_next(problem):
            return None
        costs = self._table.costs(problem)
        if costs is not None:
            exact = next(regret.regret for regret in _ranked(problem, *costs) if regret.visit == visit)
            return RegretBounds(exact, exact, exact)
        before = self._plan(problem, plan)
        leg = float(problem.distances[problem.start, problem.location(visit)])
        if before.visits[0] == visit:
            cost, lower, proven = before.cost, before.lower_bound, before.status is Status.OPTIMAL
        else:
            rest = self._solve(after(problem, visit), self._planned)
            cost, lower = leg + rest.cost, leg + rest.lower_bound
            proven = before.status is rest.status is Status.OPTIMAL
        exact = max(0.0, cost - before.cost)
        if proven:
            return RegretBounds(exact, exact, exact)
        lower = max(0.0, lower - min(before.cost, cost))
        return RegretBounds(lower, max(lower, cost - before.lower_bound), None)

    def _plan(self, problem: RoutingProblem, plan: Plan | None) -> Plan:
        """Return a plan for a problem, which is `plan` itself if it was made for this problem."""
        if self._planned is None or not same_problem(self._planned[0], problem):
            if plan is not None and is_for(plan, problem):
                self._search.learn(problem, plan)
            else:
                plan = self._solve(problem, self._planned)
            self._planned = problem, plan
        return self._planned[1]

    def _solve(self, problem: RoutingProblem, before: tuple[RoutingProblem, Plan] | None) -> Plan:
        if self.solver.applies(problem):
            return self._search.plan(problem, limit=self.limit, before=before)
        return self.solver.solve(problem, limit=self.limit)


def same_state(one: TaskState, other: TaskState) -> bool:
    """Return True if the person and all objects are in the same places in both states."""
    first, second = ((state.position, state.carried, state.loose) for state in (one, other))
    return one is other or first == second


def regrets(
    problem: RoutingProblem,
    solver: Solver,
    *,
    limit: SolveLimit | None = None,
    radius: float = RADIUS,
    plan: Plan | None = None,
    table: TaskTable | None = None,
    search: TaskSearch | None = None,
) -> tuple[Regret, ...]:
    """Return the regrets of all possible next visits, starting with the best visit.

    The exact planner evaluates all visits at once. It uses the full table for up to 18 objects, and for up to 24
    objects one pass over all tours that are at most `radius` metres longer than the best tour. Regrets above the radius
    are lower bounds, marked as `capped`. If the pass is too large, the radius is halved, down to 0.1 m. If the
    pass is still too large, if the best tour is not proven optimal, or with more objects, the regrets are estimated
    with lower bounds, and are not `proven`. With other planners or capacities, the remaining task is solved
    separately after each visit, with `limit` for each of these problems.

    `plan` is a plan for this problem, or None to search for one. `table` and `search` come from earlier states of the
    task. Without a `search`, the exact planner has the budget of `limit`. Raises ProblemError if a radius is negative.
    """
    if not radius >= 0:
        raise ProblemError(f"the radius of regrets must be at least 0 m, got {radius}")
    if not isinstance(solver, ExactSolver) or not solver.applies(problem):
        return one_by_one(problem, solver, limit=limit)
    costs = (table or TaskTable(solver.tabled)).costs(problem)
    if costs is not None:
        return _ranked(problem, *costs)
    return _around_best(problem, search or TaskSearch(solver, limit), limit, radius, plan)


def one_by_one(
    problem: RoutingProblem, solver: Solver, *, limit: SolveLimit | None = None
) -> tuple[Regret, ...]:
    """Compute regrets with any solver by solving the remaining task after each possible next visit."""
    found = []
    for visit in possible_next(problem):
        plan = solver.solve(after(problem, visit), limit=limit)
        cost = float(problem.distances[problem.start, problem.location(visit)]) + plan.cost
        found.append((cost, visit, plan.status is Status.OPTIMAL))
    least = min((cost for cost, _, _ in found), default=0.0)
    proven = all(proven for _, _, proven in found)  # a single unproven cost makes all regrets unproven
    found.sort(key=lambda entry: entry[0])
    return tuple(Regret(visit, cost, cost - least, proven) for cost, visit, _ in found)


def _ranked(
    problem: RoutingProblem,
    costs: Costs,
    unit: float,
    longest: float = math.inf,
    least: Costs | None = None,
) -> tuple[Regret, ...]:
    found = []
    for visit in possible_next(problem):
        cost, capped = costs[visit], costs[visit] > longest
        found.append((max(longest, least[visit]) if capped and least else cost, capped, visit))
    found.sort(key=lambda entry: entry[:2])
    lowest = found[0][0] if found else 0
    return tuple(
        Regret(visit, cost * unit, (cost - lowest) * unit, True, capped) for cost, capped, visit in found
    )


def _around_best(
    problem: RoutingProblem, search: TaskSearch, limit: SolveLimit | None, radius: float, plan: Plan | None
) -> tuple[Regret, ...]:
    """Compute all regrets in one pass over the tours that are at most `radius` longer than the proven optimum.

    If the pass is too large or no plan is proven optimal, the regrets are estimates.
    """
    if plan is None:
        plan = search.plan(problem, limit=limit)
    else:
        search.learn(problem, plan)
    metric, unit = problem.integers.metric, problem.integers.unit
    best = int(tour_length(problem, plan.visits, metric))
    is_searched, end = plan.status is Status.OPTIMAL and search.share(problem) > 0, Deadline.of(limit)
    instance, n = make_instance(problem, metric), len(problem.shipments)
    start = search.start(problem, instance)
    bound = first_bound(instance, best) if start is None else warm_bound(instance, start, MAX_ROWS)
    if is_searched:
        bound = grown(bound, best, MAX_ROWS, end)
    least = _least(bound, problem)
    dearest = (2 * n + len(problem.onboard)) * int(metric.max())  # upper bound on tour lengths
    while is_searched:
        longest = best + math.floor(min(radius / unit, dearest))
        most = min(MAX_STATES, search.share(problem))
        costs, states = costs_by_pass(bound, problem.names[:n], problem.names[n:], longest, most, end)
        search.spend(states)
        if costs is not None:
            return _ranked(problem, costs, unit, longest, least)
        radius /= 2
        is_searched = radius >= MIN_RADIUS and not end.over()
    return _estimated(plan, least, unit)


def _least(bound: Bound, problem: RoutingProblem) -> Costs:
    """Return a lower bound on the cost of each possible next visit, in units."""
    n, moves, table = len(problem.shipments), moves_of(bound.instance), bound.table
    relaxed = costs_in(moves, table, len(table.bin) - 1, problem.names[:n], problem.names[n:])
    return {visit: cost - bound.prices for visit, cost in relaxed.items()}


def _estimated(plan: Plan, least: Costs, unit: float) -> tuple[Regret, ...]:
    """Estimate regrets by the differences between lower bounds. The first visit of the plan is the best one."""
    first = plan.visits[0]
    extra = {visit: max(0.0, (cost - least[first]) * unit) for visit, cost in least.items()}
    ordered = sorted(extra, key=lambda visit: (extra[visit], visit != first))
    return tuple(Regret(visit, plan.cost + extra[visit], extra[visit], proven=False) for visit in ordered)
