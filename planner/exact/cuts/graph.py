"""The state graph, in which a tour is a walk and what the person carries is part of the node.

Nodes are numbered as in `planner.cuts_checker`, which has code of its own. Bins at the same place are merged. A tour
visits the nodes of each object exactly once. It is therefore a unit flow from the root to the end that enters the nodes
of each object once and is connected.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.exact.instance import FAR, Instance

NO_OBJECT = -1
LONGEST = 1 << 21  # longest leg for which solvers, which compute with floats, sum up tours precisely enough


class StateGraph(NamedTuple):
    """Arcs between states. Arrays have one entry per arc, and `object` has one entry per node."""

    tail: NDArray[np.int64]
    head: NDArray[np.int64]
    length: NDArray[np.int64]  # in units of the instance
    most: NDArray[np.int64]  # upper bound on the number of times that a tour uses the arc
    picks: NDArray[np.int64]  # object that is picked up at the head of the arc, or `NO_OBJECT`
    object: NDArray[np.int64]  # object that is picked up at each node, or `NO_OBJECT`
    objects: int  # number of objects
    root: int
    end: int

    def only(self, arcs: NDArray[np.bool_]) -> "StateGraph":
        """Return the graph with a subset of the arcs and the same nodes."""
        tail, head, length, most, picks = (field[arcs] for field in self[:5])
        return StateGraph(tail, head, length, most, picks, *self[5:])


def merged(instance: Instance) -> Instance:
    """Return the instance with bins at distance 0 from each other merged, because the graph grows with the bins.

    Merged bins are numbered in the order of their first bins.
    """
    first = np.argmax(instance.bins == 0, axis=1)  # first bin at the same place as each bin
    kept, place = np.unique(first, return_inverse=True)
    return instance._replace(
        to_bin=instance.to_bin[:, kept],
        bins=instance.bins[np.ix_(kept, kept)],
        home=place[instance.home],
        root_bin=instance.root_bin[kept],
        carried=place[instance.carried],
    )


def state_graph(instance: Instance) -> StateGraph:
    """Return the state graph of an instance with at least one object."""
    inst = merged(instance)
    n, m = inst.to_bin.shape
    bins, objects, home = np.arange(m), np.arange(n), inst.home
    at_bin = np.arange(m * m).reshape(m, m)
    at_object = m * m + np.arange(n * (m + 1)).reshape(n, m + 1)
    root, end = m * m + n * (m + 1), m * m + n * (m + 1) + 1
    empty, alone, second = at_bin[bins, bins], at_object[:, m], at_object[:, :m]
    apart = bins[:, None] != bins
    groups: list[tuple[Any, Any, Any]] = [
        (empty, end, 0),
        (empty[:, None], alone, inst.to_bin.T),
        (alone, empty[home], inst.to_bin[objects, home]),
        (alone[:, None], second[:, home].T, inst.between),
        (second, at_bin[:, home].T, inst.to_bin),
        (second, at_bin[home], inst.to_bin[objects, home][:, None]),
        (at_bin, empty, np.where(apart, inst.bins, FAR)),
        (at_bin[:, :, None], second.T, np.where(apart[:, :, None], inst.to_bin.T[:, None], FAR)),
        *_first_arcs(inst, root, alone, second, at_bin),
    ]
    table = np.concatenate([np.stack(np.broadcast_arrays(*group)).reshape(3, -1) for group in groups], axis=1)
    table = np.unique(table[:, table[2] < FAR], axis=1)  # placing both objects in one bin occurs twice
    node_object = np.full(end + 1, NO_OBJECT)
    node_object[at_object] = objects[:, None]
    tail, head, length = table
    once = (node_object[tail] >= 0) | (node_object[head] >= 0) | (tail == root) | (head == end)
    graph = StateGraph(tail, head, length, np.where(once, 1, n), node_object[head], node_object, n, root, end)
    return graph.only(_reached(graph)[tail])


def _first_arcs(
    inst: Instance, root: int, alone: NDArray[np.int64], second: NDArray[np.int64], at_bin: NDArray[np.int64]
) -> list[tuple[int, NDArray[np.int64], NDArray[np.int64]]]:
    carried = inst.carried
    if carried.size == 0:
        return [(root, alone, inst.root)]
    if carried.size == 1:
        d = carried[0]
        return [(root, at_bin[d, d], inst.root_bin[d]), (root, second[:, d], inst.root)]
    return [(root, at_bin[carried, carried[::-1]], inst.root_bin[carried])]


def _reached(graph: StateGraph) -> NDArray[np.bool_]:
    """Return which nodes can be reached from the root."""
    reached = np.zeros(len(graph.object), bool)
    reached[graph.root] = True
    while True:
        new = graph.head[reached[graph.tail]]
        if reached[new].all():
            return reached
        reached[new] = True


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
