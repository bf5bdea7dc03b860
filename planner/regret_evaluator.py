"""What visits cost compared with the best ones, for one state of a task after the other.

A full table of costs-to-go holds for every later state in which nothing was moved, wherever the person is and whatever
is carried. So it is filled once per task (from 18 objects left on), and all later questions are looked up.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from planner.certificate import Certificate, Proof
from planner.exact.groups import alone
from planner.exact.instance import Instance, make_instance
from planner.exact.relaxation import after_pick, fill
from planner.exact.solver import ExactSolver
from planner.exact.table import Table, new_table
from planner.exact.warm import Warm, same_groups
from planner.geodesics import Geodesics
from planner.plan import Plan, Status, Visit, VisitKind
from planner.problem import RoutingProblem
from planner.regret import RADIUS, Regret, after, ranked, regrets
from planner.replanner import Replanner, Stop, name_of
from planner.route import XY, TaskState
from planner.solver import SolveLimit
from planner.tour import integer_metric, possible_next, tour_length

SAME = 1e-6  # m

Spots = Mapping[tuple[VisitKind, str], XY]


@dataclass(frozen=True, eq=False)
class _Kept:
    """A filled table by names: row bit and position of each object, number of each bin's position."""

    instance: Instance
    table: Table
    objects: Mapping[str, tuple[int, XY]]
    bins: Mapping[XY, int]


class RegretEvaluator:
    """Judges possible and actual visits, always with the exact planner; results repeat bit for bit.

    Args:
        geodesics: Distances.
        solver: The exact planner as it is to be; None for the usual one.
        capacity: How many objects can be carried.
        limit: Of each search, beyond 18 objects left; None for the planner's own budget of work.
        radius: `all` gives regrets up to here exactly, m.
    """

    def __init__(
        self,
        geodesics: Geodesics,
        *,
        solver: ExactSolver | None = None,
        capacity: int = 2,
        limit: SolveLimit | None = None,
        radius: float = RADIUS,
    ) -> None:
        self._solver = solver or ExactSolver()
        self._tasks = Replanner(geodesics, self._solver, capacity=capacity)
        self._limit = limit
        self._radius = radius
        self._kept: _Kept | None = None
        self._last: tuple[TaskState, dict[Stop, Regret]] | None = None

    def all(self, state: TaskState, plan: Plan | None = None) -> dict[Stop, Regret]:
        """What each possible next visit costs compared with the best one, the best first.

        Args:
            state: The task as it is now.
            plan: What was planned for this state or before it; if it is proven and of this state, no other is searched.

        Raises:
            UnreachableError: Objects that cannot be fetched or delivered; `names` lists them.
            ProblemError: More is carried than the capacity allows.
        """
        if self._last is None or not same_state(self._last[0], state):
            problem, names, spots = self._tasks.task(state)
            found = self._by_table(problem, names, state, spots)
            if found is None:
                best = plan if plan is not None and _is_best(plan, problem) else None
                found = regrets(problem, self._solver, limit=self._limit, radius=self._radius, plan=best)
            self._last = state, {name_of(regret.visit, names, state): regret for regret in found}
        return dict(self._last[1])

    def of(self, state: TaskState, stop: Stop, plan: Plan | None = None) -> float | None:
        """By how much a visit makes the rest of the task longer than the best one does, m.

        Args:
            state: The task before the visit.
            stop: The visit.
            plan: As in `all`.

        Returns:
            The exact regret, however large; None where the visit is not possible or nothing is proven.
        """
        if self._last is not None and same_state(self._last[0], state):
            known = self._last[1].get(stop)
            if known is not None and known.proven and not known.capped:
                return known.regret
        problem, names, spots = self._tasks.task(state)
        visits = {name_of(visit, names, state): visit for visit in possible_next(problem, ())}
        if stop not in visits:
            return None
        found = self._by_table(problem, names, state, spots)
        if found is not None:
            return next(regret.regret for regret in found if regret.visit == visits[stop])
        before = plan if plan is not None and _is_best(plan, problem) else self._solve(problem)
        rest = self._rest(problem, visits[stop], before)
        if not before.status is rest.status is Status.OPTIMAL:
            return None
        leg = float(problem.distances[problem.start, visits[stop].location])
        return max(0.0, leg + rest.cost - before.cost)

    def _solve(self, problem: RoutingProblem) -> Plan:
        return self._solver.solve(problem, limit=self._limit)

    def _rest(self, problem: RoutingProblem, visit: Visit, before: Plan) -> Plan:
        """The best plan after a visit; what is known from before it halves the work."""
        for plan in self._solver.improve(
            after(problem, visit), limit=self._limit, warm=_known(before, visit)
        ):
            best = plan
        return best

    def _by_table(
        self, problem: RoutingProblem, names: list[str], state: TaskState, spots: Spots
    ) -> tuple[Regret, ...] | None:
        """Regrets from the kept table, or a new one if that does not hold here; None if it would be too large."""
        metric = integer_metric(problem.distances)
        if not self._solver.applies(problem, metric):
            return None
        if self._kept is None or not _holds(self._kept, names, state, spots):
            instance = make_instance(problem, metric)
            if not self._solver.table_fits(instance):
                return None
            self._kept = _keep(problem, instance, names, state, spots)
        costs = _look_up(self._kept, problem, metric[problem.start].tolist(), names, state, spots)
        return ranked(problem, costs, max(costs.values(), default=0), costs)


def _is_best(plan: Plan, problem: RoutingProblem) -> bool:
    """Whether it is a proven plan of this very problem, and not of an earlier state of the task."""
    if plan.status is not Status.OPTIMAL or len(plan.visits) != 2 * len(problem.shipments) + len(
        problem.onboard
    ):
        return False
    length = tour_length(problem.distances, problem.start, plan.visits)
    return abs(length - plan.cost) <= SAME


def _known(plan: Plan, visit: Visit) -> Warm | None:
    """What a plan says of the problem after a visit."""
    certificate = plan.certificate
    if certificate is None or certificate.proof is not Proof.RELAXATION:
        return None
    gone = visit.shipment if visit.kind is VisitKind.PICK else None
    left = [k for k in range(len(certificate.multipliers)) if k != gone]
    number = {k: i for i, k in enumerate(left)}
    prices = tuple(certificate.multipliers[k] for k in left)
    picked = [v.shipment for v in plan.visits if v.kind is VisitKind.PICK]
    return Warm(
        Certificate(Proof.RELAXATION, 0, same_groups(certificate.groups, left), prices),
        tuple(number[k] for k in picked if k in number),
    )


def same_state(one: TaskState, other: TaskState) -> bool:
    """Whether person and objects are where they were; where things belong does not change."""
    return one is other or (one.position, one.carried, one.loose) == (
        other.position,
        other.carried,
        other.loose,
    )


def _homes(names: list[str], state: TaskState, spots: Spots) -> dict[str, XY]:
    return {name: spots[VisitKind.PLACE, name] for name in (*names, *state.carried)}


def _holds(kept: _Kept, names: list[str], state: TaskState, spots: Spots) -> bool:
    """Whether all that lies about still lies where it lay, and all bins are known."""
    return all(
        name in kept.objects and kept.objects[name][1] == spots[VisitKind.PICK, name] for name in names
    ) and all(home in kept.bins for home in _homes(names, state, spots).values())


def _keep(
    problem: RoutingProblem, instance: Instance, names: list[str], state: TaskState, spots: Spots
) -> _Kept:
    table = new_table(instance, alone(len(names)))
    fill(instance, table)
    located = sorted({s.delivery for s in problem.shipments} | set(problem.onboard))
    at = {s.delivery: spots[VisitKind.PLACE, n] for s, n in zip(problem.shipments, names, strict=True)}
    at |= {j: spots[VisitKind.PLACE, n] for j, n in zip(problem.onboard, state.carried, strict=True)}
    return _Kept(
        instance,
        table,
        {name: (k, spots[VisitKind.PICK, name]) for k, name in enumerate(names)},
        {at[location]: b for b, location in enumerate(located)},
    )


def _look_up(
    kept: _Kept,
    problem: RoutingProblem,
    from_here: list[int],
    names: list[str],
    state: TaskState,
    spots: Spots,
) -> dict[int, int]:
    """Length of the rest of the task by next action, units, as `costs_by_table` would give it.

    Only the distances from where the person is, `from_here`, are those of the present problem.
    """
    number = [kept.objects[name][0] for name in names]
    carried = [kept.bins[spots[VisitKind.PLACE, name]] for name in state.carried]
    row = sum(1 << k for k in number)
    costs = {}
    for k, (location, b) in enumerate(zip(problem.onboard, carried, strict=True)):
        other = carried[1 - k] if len(carried) == 2 else b
        costs[-1 - k] = from_here[location] + int(kept.table.bin[row, b, other])
    if len(carried) < 2:
        for j, k in enumerate(number):
            left = row ^ (1 << k)
            if carried:
                rest = after_pick(kept.instance, kept.table, left, k, carried[0])
            else:
                rest = int(kept.table.object[left, k])
            costs[j] = from_here[problem.shipments[j].pickup] + rest
    return costs
