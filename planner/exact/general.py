"""Proven optimal tours for any capacity and any distances, by best-first search; for tasks of a few objects."""

import heapq
from dataclasses import dataclass

from planner.errors import InfeasibleError
from planner.exact.deadline import NEVER, Deadline
from planner.integer_distances import shortest_connections
from planner.plan import Visit
from planner.problem import RoutingProblem

# Location, which shipments are not yet picked (bits), and where each carried object goes (sorted).
State = tuple[int, int, tuple[int, ...]]
Matrix = list[list[float]]
ROUNDING = 1e-12  # share by which sums of floats may be off


@dataclass(frozen=True)
class Ending:
    """Where a best-first search ended.

    Attributes:
        visits: The optimal tour, or None if the search was cut short.
        bound: No tour is shorter than this, m.
    """

    visits: list[Visit] | None
    bound: float


def best_first(problem: RoutingProblem, max_states: int, deadline: Deadline = NEVER) -> Ending:
    """Search states by cost so far plus the farthest trip left (A*).

    In a metric it is free and never wrong to drop on arrival what belongs there. Otherwise a later visit to the same
    place may be cheaper, so each drop is a move of its own. Lengths are sums of floats of one sign: whatever the range
    of the distances, rounding is a share of each sum.

    Args:
        problem: What is left to do.
        max_states: How many states may be expanded.
        deadline: Give up when it is over.

    Raises:
        InfeasibleError: No order of visits keeps to the capacity.
    """
    at_once = problem.integers.is_metric
    metric = shortest_connections(problem.distances, problem.used).tolist()
    search = _Search(problem, metric if at_once else problem.distances.tolist(), metric, at_once=at_once)
    start = search.arrive(problem.start, (1 << len(problem.shipments)) - 1, problem.onboard)
    frontier: list[tuple[float, float, State]] = [(search.still_to_go(start), 0.0, start)]
    cost: dict[State, float] = {start: 0.0}
    before: dict[State, State] = {}
    closed: set[State] = set()
    while frontier:
        estimate, so_far, state = heapq.heappop(frontier)
        if state in closed:
            continue
        if not state[1] and not state[2]:
            return Ending(search.visits(state, before), so_far * (1 - ROUNDING))
        if len(closed) == max_states or (len(closed) % 16 == 0 and deadline.over()):
            return Ending(None, estimate * (1 - ROUNDING))
        closed.add(state)
        for leg, following in search.moves(state):
            total = so_far + leg
            if following not in cost or total < cost[following]:
                cost[following], before[following] = total, state
                heapq.heappush(frontier, (total + search.still_to_go(following), total, following))
    raise InfeasibleError("no order of visits keeps to the capacity")


class _Search:
    """Moves and bounds of one problem."""

    def __init__(self, problem: RoutingProblem, legs: Matrix, metric: Matrix, *, at_once: bool) -> None:
        self._problem = problem
        self._legs = legs
        self._metric = metric
        self._at_once = at_once
        self._trip = [metric[s.pickup][s.delivery] for s in problem.shipments]

    def arrive(self, here: int, left: int, carried: tuple[int, ...]) -> State:
        """State on arrival, with what belongs here dropped."""
        return here, left, tuple(sorted(j for j in carried if not (self._at_once and j == here)))

    def moves(self, state: State) -> list[tuple[float, State]]:
        """Length of the leg to every feasible next state, and that state."""
        here, left, carried = state
        row = self._legs[here]
        found = []
        for j in dict.fromkeys(carried):
            rest = list(carried)
            rest.remove(j)
            found.append((row[j], self.arrive(j, left, tuple(rest))))
        if len(carried) < self._problem.capacity:
            for k, shipment in enumerate(self._problem.shipments):
                if left >> k & 1:
                    held = (*carried, shipment.delivery)
                    found.append((row[shipment.pickup], self.arrive(shipment.pickup, left ^ 1 << k, held)))
        return found

    def still_to_go(self, state: State) -> float:
        """A lower bound: the farthest single trip that is left."""
        here, left, carried = state
        row = self._metric[here]
        farthest = max((row[j] for j in carried), default=0.0)
        for k, shipment in enumerate(self._problem.shipments):
            if left >> k & 1:
                farthest = max(farthest, row[shipment.pickup] + self._trip[k])
        return farthest

    def visits(self, end: State, before: dict[State, State]) -> list[Visit]:
        """The visits that lead to a state."""
        chain = [end]
        while chain[-1] in before:
            chain.append(before[chain[-1]])
        chain.reverse()
        problem = self._problem
        n = len(problem.shipments)
        holding = [(j, problem.place(n + k)) for k, j in enumerate(problem.onboard)]
        left, visits = (1 << n) - 1, list[Visit]()
        for _, now_left, carried in chain:
            for k, shipment in enumerate(problem.shipments):
                if (left ^ now_left) >> k & 1:
                    visits.append(problem.pick(k))
                    holding.append((shipment.delivery, problem.place(k)))
            left = now_left
            for dropped in _difference([j for j, _ in holding], carried):
                at = next(i for i, (j, _) in enumerate(holding) if j == dropped)
                visits.append(holding.pop(at)[1])
        return visits


def _difference(held: list[int], still: tuple[int, ...]) -> list[int]:
    """The entries of `held` without those of `still`, as multisets."""
    rest = list(held)
    for j in still:
        rest.remove(j)
    return rest
