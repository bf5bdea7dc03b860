"""Connectivity cuts: every set of states in which an object is picked up is entered from outside.

For a set of nodes without the root and an object k, the flow that enters the set is at least the flow that enters
nodes of k inside the set. A maximum flow from the root to the nodes of k finds the most violated cut of k.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.exact.cuts.graph import StateGraph
from planner.solvers import Deadline

PARTS = 1_000_000  # number of parts of a unit of flow in maximum flows, which are computed with integers
SUPPORT = 1e-9  # arcs with less flow are ignored
VIOLATION = 1e-3  # minimum violation of a new cut


class Cut(NamedTuple):
    """A connectivity cut, which states that `inside` is entered at least as often as `object` is picked up in it."""

    object: int
    inside: NDArray[np.bool_]  # True for the nodes of the set, shape (nodes,)

    def coefficients(self, graph: StateGraph) -> NDArray[np.int64]:
        """Return the coefficient of each arc in the cut, whose sum over a tour is at least 0."""
        into = self.inside[graph.head]
        entering = (into & ~self.inside[graph.tail]).astype(np.int64)
        entering -= into & (graph.picks == self.object)
        return entering


def violated(graph: StateGraph, flow: NDArray[np.float64], deadline: Deadline) -> list[Cut]:
    """Return violated cuts of a flow, beginning with the most violated one.

    For each object, the largest and the smallest of the most violated sets are returned. Only the cuts near the root
    would make the bound stall.
    """
    from scipy.sparse import csr_matrix  # imported here because SciPy is slow to import
    from scipy.sparse.csgraph import breadth_first_order, maximum_flow

    used = flow > SUPPORT
    tail, head = graph.tail[used], graph.head[used]
    parts = np.rint(flow[used] * PARTS).astype(np.int64)
    nodes = len(graph.object)
    entering = np.bincount(head, weights=parts, minlength=nodes).astype(np.int64)
    found: list[tuple[float, Cut]] = []
    for k in range(graph.objects):
        if deadline.over():
            break
        goals = np.flatnonzero((graph.object == k) & (entering > 0))
        to = np.full(len(goals), nodes)
        capacity = np.concatenate([parts, entering[goals]]).astype(np.int32)
        places = (np.concatenate([tail, goals]), np.concatenate([head, to]))
        network = csr_matrix((capacity, places), shape=(nodes + 1, nodes + 1))
        best = maximum_flow(network, graph.root, nodes)
        violation = 1.0 - best.flow_value / PARTS
        if violation <= VIOLATION:
            continue
        residual = network - best.flow
        residual.data[residual.data < 0] = 0
        residual.eliminate_zeros()
        near_root = breadth_first_order(residual, graph.root, return_predecessors=False)
        near_goal = breadth_first_order(residual.T.tocsr(), nodes, return_predecessors=False)
        sets = np.ones(nodes + 1, bool), np.zeros(nodes + 1, bool)
        sets[0][near_root], sets[1][near_goal] = False, True
        for inside in sets[: 1 if (sets[0] == sets[1]).all() else 2]:
            inside[graph.end] = False
            found.append((violation, Cut(k, inside[:nodes])))
    return [cut for _, cut in sorted(found, key=lambda entry: -entry[0])]
