"""Find a first tour by simulated annealing over the order in which objects are picked up."""

import numpy as np
from numpy.typing import NDArray

from mjsim.support.kernels import inlined, kernel
from planner.exact.instance import Instance
from planner.exact.moves import NOTHING, NOWHERE, Moves
from planner.exact.table import INFINITE
from planner.solvers import NEVER, Deadline

Ways = dict[int, tuple[int, list[int]]]  # length and actions of the shortest known way to each place
SLICE = 10_000  # number of moves between two checks of the deadline, which takes about 15 ms


@inlined
def uniform(state: NDArray[np.uint64]) -> float:
    """Return a random number in [0, 1) from the generator SplitMix64 (Steele, Lea and Flood 2014)."""
    state[0] += np.uint64(0x9E3779B97F4A7C15)
    z = state[0]
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z = z ^ (z >> np.uint64(31))
    return np.float64(z >> np.uint64(11)) * (1.0 / 9007199254740992.0)


@kernel
def decode(inst: Instance, order: NDArray[np.int64], start: int, costs: NDArray[np.int64]) -> int:
    """Return the length of the shortest tour with a given order of picks.

    Entry [t, d] of `costs` (n + 1, m + 1) is set to the lowest cost at pick t with an object for bin d
    in the other hand, or none if d = m. Row n is the end of the tour. Rows before `start` must be valid.
    """
    n, m = inst.to_bin.shape
    if start == 0:
        costs[0] = INFINITE
        _start(inst, order, costs[0])
        start = 1
    for t in range(start, n):
        _advance(inst, order[t - 1], order[t], costs[t - 1], costs[t])
    if n:
        costs[n] = INFINITE
        costs[n, m] = _finish(inst, order[n - 1], costs[n - 1])
    return int(costs[n, m])


@inlined
def _start(inst: Instance, order: NDArray[np.int64], after: NDArray[np.int64]) -> None:
    m, count = inst.bins.shape[0], inst.carried.size
    x = order[0] if order.size else -1
    for k in range(count):  # place this object first, and another one before the first pick or later
        b, other = inst.carried[k], inst.carried[count - 1 - k]
        leg = inst.to_bin[x, b] if x >= 0 else 0
        if b == other:  # also if only one object is carried
            after[m] = inst.root_bin[b] + leg
        else:
            after[other] = inst.root_bin[b] + leg
            last = inst.to_bin[x, other] if x >= 0 else 0
            after[m] = min(after[m], inst.root_bin[b] + inst.bins[b, other] + last)
    if count < 2 and x >= 0:
        after[inst.carried[0] if count else m] = inst.root[x]
    elif count == 0:
        after[m] = 0


@inlined
def _advance(inst: Instance, i: int, x: int, before: NDArray[np.int64], after: NDArray[np.int64]) -> None:
    m = inst.bins.shape[0]
    c = inst.home[i]
    from_i, from_x, between = inst.to_bin[i], inst.to_bin[x], inst.bins[c]
    over_c = from_i[c] + from_x[c]
    keep_own = before[m] + inst.between[i, x]
    nothing = before[m] + over_c
    for d in range(m):
        after[d] = before[d] + over_c
        if d != c:  # if d == c, both objects are placed in bin c
            keep_own = min(keep_own, before[d] + from_i[d] + from_x[d])
        both = between[d] + min(from_i[d] + from_x[c], from_i[c] + from_x[d])
        nothing = min(nothing, before[d] + both)
    after[c] = keep_own
    after[m] = nothing


@inlined
def _finish(inst: Instance, i: int, before: NDArray[np.int64]) -> int:
    m = inst.bins.shape[0]
    c = inst.home[i]
    best = before[m] + inst.to_bin[i, c]
    for d in range(m):
        best = min(best, before[d] + inst.bins[c, d] + min(inst.to_bin[i, d], inst.to_bin[i, c]))
    return int(best)


def tour_actions(moves: Moves, order: NDArray[np.int64]) -> list[int]:
    """Return the actions of a shortest tour with a given order of picks, as defined in `Solution`."""
    ways: Ways = {len(moves.end) - 1: (0, [])}
    # The person may visit two bins before the first pick, and one bin after each pick.
    for x in [NOTHING, NOTHING, *(move for k in order.tolist() for move in (k, NOTHING))]:
        after: Ways = dict(ways) if x == NOTHING else {}
        for place, (length, actions) in ways.items():
            for end, leg in zip(moves.end[place, x].tolist(), moves.length[place, x].tolist(), strict=True):
                if end != NOWHERE and (end not in after or length + leg < after[end][0]):
                    picked = [] if x == NOTHING else [x]
                    placed = [-1 - end // moves.bins] if end < moves.bins**2 else []
                    after[end] = length + leg, [*actions, *picked, *placed]
        ways = after
    return min(way for place, way in ways.items() if moves.end[place, NOTHING, 0] == NOWHERE)[1]


@inlined
def propose(order: NDArray[np.int64], candidate: NDArray[np.int64], state: NDArray[np.uint64]) -> int:
    """Change an order at random by swapping two objects, reversing a section, or moving an object.

    The new order is written to `candidate`. Return the first position that may have changed.
    """
    n = order.size
    i = int(uniform(state) * n)
    j = int(uniform(state) * (n - 1))
    if j >= i:
        j += 1
    kind = uniform(state)
    low, high = min(i, j), max(i, j)
    for k in range(n):  # loops compile much faster than slices
        candidate[k] = order[k]
    if kind < 0.25:
        candidate[i], candidate[j] = order[j], order[i]
    elif kind < 0.5:
        for k in range(low, high + 1):
            candidate[k] = order[low + high - k]
    elif i < j:
        for k in range(i, j):
            candidate[k] = order[k + 1]
        candidate[j] = order[i]
    else:
        for k in range(j, i):
            candidate[k + 1] = order[k]
        candidate[j] = order[i]
    return low


def anneal(
    inst: Instance,
    seed: int,
    moves: int,
    first: NDArray[np.int64],
    hot: float,
    cold: float,
    deadline: Deadline = NEVER,
) -> tuple[int, NDArray[np.int64]]:
    """Improve an order of picks by simulated annealing. Temperatures are relative to the mean leg length.

    Return the length of the best tour and its order of picks. After the deadline, no more moves are tried.
    """
    n = first.size
    best, best_order, order = tour_units(inst, first), first, first.copy()
    state, temperature = np.array([seed], np.uint64), hot * (best / (2.0 * max(1, n)))
    cooling = (cold / hot) ** (1.0 / moves)
    for done in range(0, moves if n > 1 else 0, SLICE):
        if deadline.over():
            break
        tried = min(SLICE, moves - done)
        length, found, temperature = try_moves(inst, state, order, tried, temperature, cooling)
        if length < best:
            best, best_order = int(length), found
    return best, best_order


@kernel
def try_moves(
    inst: Instance,
    state: NDArray[np.uint64],
    order: NDArray[np.int64],
    moves: int,
    temperature: float,
    cooling: float,
) -> tuple[int, NDArray[np.int64], float]:
    """Change an order of picks at random, and accept longer tours with a probability that falls with the temperature.

    `state` and `order` are updated. Return the best length, its order, and the temperature at the end.
    """
    n, m = inst.to_bin.shape
    costs, trial_costs = np.empty((n + 1, m + 1), np.int64), np.empty((n + 1, m + 1), np.int64)
    cost = decode(inst, order, 0, costs)
    best, best_order = cost, order.copy()
    current, candidate = order.copy(), order.copy()
    for _ in range(moves):
        temperature *= cooling
        low = propose(current, candidate, state)
        for t in range(low):
            for d in range(m + 1):
                trial_costs[t, d] = costs[t, d]
        trial = decode(inst, candidate, low, trial_costs)
        if trial <= cost or uniform(state) < np.exp((cost - trial) / temperature):
            cost = trial
            current, candidate = candidate, current
            costs, trial_costs = trial_costs, costs
            if cost < best:
                best = cost
                for k in range(n):
                    best_order[k] = current[k]
    order[:] = current
    return best, best_order, temperature


def tour_units(inst: Instance, order: NDArray[np.int64]) -> int:
    """Return the length of the shortest tour with a given order of picks, in units."""
    return int(decode(inst, order, 0, np.empty((len(order) + 1, len(inst.bins) + 1), np.int64)))


def inserted(inst: Instance, order: list[int], cycles: list[list[int]]) -> NDArray[np.int64]:
    """Return an order of picks, in which each cycle is turned and inserted where the tour becomes shortest."""
    order = [*order, *(k for cycle in cycles for k in cycle)]
    for cycle in cycles:
        rest = [k for k in order if k not in cycle]
        turned = [cycle[k:] + cycle[:k] for k in range(len(cycle))]
        places = range(len(rest) + 1)
        order = min(
            ([*rest[:t], *turn, *rest[t:]] for turn in turned for t in places),
            key=lambda each: tour_units(inst, np.array(each, dtype=np.int64)),
        )
    return np.array(order, dtype=np.int64)


def completed(inst: Instance, order: list[int]) -> NDArray[np.int64]:
    """Return an order of picks, with missing objects inserted where they lengthen the tour least."""
    return inserted(inst, order, [[k] for k in sorted(set(range(len(inst.home))) - set(order))])
