"""Whether a shorter tour exists, for any capacity and distances, by visiting every state that may lead to one."""

from planner.problem import RoutingProblem
from planner.relaxation_checker import closed

# Location, objects left (bits), and the bins of what is carried.
State = tuple[int, int, tuple[int, ...]]


def sweep_orders(problem: RoutingProblem, limit: float, max_states: int) -> tuple[bool, int] | None:
    """Look for a tour shorter than a limit, m, by number of visits made; states that cannot lead to one are left out.

    Returns:
        Whether there is one, and how many states were looked at; None if they were too many.
    """
    d, direct = problem.distances.tolist(), closed(problem).tolist()
    jobs = [(s.pickup, s.delivery) for s in problem.shipments]

    def still(here: int, left: int, carried: tuple[int, ...]) -> float:
        """The farthest single trip left."""
        trips = [direct[here][a] + direct[a][b] for k, (a, b) in enumerate(jobs) if left >> k & 1]
        return max([*trips, *(direct[here][j] for j in carried)], default=0.0)

    layer: dict[State, float] = {(problem.start, (1 << len(jobs)) - 1, tuple(sorted(problem.onboard))): 0.0}
    states = 0
    for _ in range(2 * len(jobs) + len(problem.onboard)):
        after: dict[State, float] = {}
        for (here, left, carried), cost in layer.items():
            options = [(j, left, carried[:k] + carried[k + 1 :]) for k, j in enumerate(carried)]
            if len(carried) < problem.capacity:
                options += [
                    (a, left ^ 1 << k, tuple(sorted((*carried, b))))
                    for k, (a, b) in enumerate(jobs)
                    if left >> k & 1
                ]
            for option in options:
                total = cost + d[here][option[0]]
                if total < after.get(option, limit) and total + still(*option) < limit:
                    after[option] = total
        layer = after
        states += len(layer)
        if states > max_states:
            return None
    return bool(layer), states
