"""Convert integer flows in the state graph to orders of picks."""

import numpy as np
from numpy.typing import NDArray

from planner.exact.annealing import decode
from planner.exact.cuts.graph import StateGraph
from planner.exact.instance import Instance


def walks(graph: StateGraph, flow: NDArray[np.int64]) -> list[list[int]]:
    """Return the objects that a flow picks up, in order, along its walk from the root and along each cycle.

    The flow is a tour if it has no cycles apart from the walk.
    """
    leaving: dict[int, list[int]] = {}
    for a in np.flatnonzero(flow).tolist():
        leaving.setdefault(int(graph.tail[a]), []).extend([a] * int(flow[a]))
    arcs = [_walk(graph, leaving, start) for start in (graph.root, *leaving) if leaving.get(start)]
    return [[k for k in graph.picks[walk].tolist() if k >= 0] for walk in arcs]


def _walk(graph: StateGraph, leaving: dict[int, list[int]], start: int) -> list[int]:
    """Return all arcs that are connected to a node as one walk, and remove them (Hierholzer 1873)."""
    stack: list[tuple[int, int]] = [(start, -1)]
    backwards = []
    while stack:
        node, arc = stack[-1]
        if leaving.get(node):
            onward = leaving[node].pop()
            stack.append((int(graph.head[onward]), onward))
        else:
            stack.pop()
            backwards.append(arc)
    return backwards[-2::-1]


def joined(instance: Instance, pieces: list[list[int]]) -> NDArray[np.int64]:
    """Return an order of picks, in which each cycle is turned and inserted where the tour becomes shortest."""
    everything = set(range(len(instance.home)))
    costs = np.empty((len(everything) + 1, len(instance.bins) + 1), np.int64)

    def length(order: list[int]) -> int:
        return int(decode(instance, np.array([*order, *sorted(everything - set(order))], np.int64), 0, costs))

    order, *cycles = pieces
    for cycle in cycles:
        turned = [cycle[k:] + cycle[:k] for k in range(len(cycle))]
        places = range(len(order) + 1)
        order = min(([*order[:t], *turn, *order[t:]] for turn in turned for t in places), key=length)
    return np.array(order, np.int64)
