"""Convert integer flows in the state graph to orders of picks."""

import numpy as np
from numpy.typing import NDArray

from planner.exact.cuts.graph import StateGraph


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
