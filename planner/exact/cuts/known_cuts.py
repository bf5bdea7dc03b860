"""Cuts of an earlier plan, which bound the tours of all later states of the same task.

Any prices of objects and any multipliers of cuts give a valid bound, so no linear problem has to be solved again.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.exact.cuts.connectivity import Cut
from planner.exact.cuts.graph import StateGraph, merged, state_graph
from planner.exact.cuts.root_bound import RootBound, root_bound
from planner.exact.instance import Instance, make_instance
from planner.plan import Certificate, Visit
from planner.problem import RoutingProblem, possible_next


class KnownCuts(NamedTuple):
    """The cuts of a plan. Objects are identified by name, and bins by the objects that belong there."""

    names: tuple[str, ...]  # names of all objects, shipments first
    home: tuple[int, ...]  # bin of each object, where bins are numbered as in the graph of states
    certificate: Certificate
    prices: Mapping[str, float]  # price of each object that was loose in this or an earlier plan, in metres

    @classmethod
    def of(cls, problem: RoutingProblem, certificate: Certificate, before: "KnownCuts | None") -> "KnownCuts":
        instance = merged(make_instance(problem, problem.integers.metric))
        home = (*instance.home.tolist(), *instance.carried.tolist())
        metres = np.array(certificate.multipliers) * (certificate.unit / certificate.parts)
        prices = dict(zip(problem.names, metres.tolist(), strict=False))
        return cls(problem.names, home, certificate, {**(before.prices if before else {}), **prices})

    def root(self, problem: RoutingProblem, instance: Instance, graph: StateGraph) -> RootBound:
        """Return the bound that the prices and cuts give for another problem."""
        parts, scale = self.certificate.parts, self.certificate.unit / instance.unit
        number = {name: k for k, name in enumerate(self.names[: len(self.certificate.multipliers)])}
        names = problem.names[: graph.objects]
        objects = np.array([number.get(name, -1) for name in names])
        node = self._nodes(problem.names, merged(instance), objects)
        count = max(self.home) + 1
        cuts = []
        for k, multiplier, members in self.certificate.cuts:
            inside = np.zeros(count**2 + len(number) * (count + 1) + 1, bool)
            inside[list(members)] = True
            cuts += [
                (Cut(j, inside[node]), round(multiplier * scale))
                for j in np.flatnonzero(objects == k).tolist()
            ]
        average = sum(self.prices.values()) / len(self.prices)
        prices = [round(self.prices.get(name, average) * parts / instance.unit) for name in names]
        return root_bound(graph, parts, np.array(prices, np.int64), cuts)

    def least(self, problem: RoutingProblem) -> dict[Visit, int]:
        """Return a lower bound on the cost of each possible next visit, in units."""
        instance = make_instance(problem, problem.integers.metric)
        graph, inst = state_graph(instance), merged(instance)
        root, parts, n = self.root(problem, instance, graph), self.certificate.parts, len(problem.shipments)
        first, m = graph.tail == graph.root, len(inst.bins)
        least = {}
        for visit in possible_next(problem):
            k = problem.number[visit.object]
            arcs = graph.picks == k if k < n else graph.head // m == inst.carried[k - n]
            least[visit] = int(-(-root.least[first & arcs].min() // parts))
        return least

    def _nodes(self, names: Sequence[str], inst: Instance, objects: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the node of this plan's graph that corresponds to each node of another graph, or -1."""
        home, m = dict(zip(self.names, self.home, strict=True)), max(self.home) + 1
        bins = np.full(len(inst.bins), -1)
        for name, b in zip(names, (*inst.home.tolist(), *inst.carried.tolist()), strict=True):
            bins[b] = home.get(name, bins[b])
        at_bin = np.where((bins < 0) | (bins[:, None] < 0), -1, bins[:, None] * m + bins)
        held, at = np.append(bins, m), objects[:, None]
        at_object = np.where((held < 0) | (at < 0), -1, m * m + at * (m + 1) + held)
        return np.concatenate([at_bin.ravel(), at_object.ravel(), [-1, -1]])
