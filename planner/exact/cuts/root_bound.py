"""An exact lower bound from rounded multipliers, so that rounding errors of a solver cannot make it invalid."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.exact.cuts.connectivity import Cut
from planner.exact.cuts.graph import StateGraph
from planner.plan import Certificate, Proof


class RootBound(NamedTuple):
    """A lower bound on tour lengths, with the multipliers that prove it, in parts of a unit."""

    value: int  # lower bound in units
    prices: NDArray[np.int64]  # multiplier of each object in parts, shape (n,)
    cuts: tuple[tuple[Cut, int], ...]  # each cut that contributes to the bound, with its multiplier in parts
    least: NDArray[np.int64]  # lower bound in parts on tours that use each arc, shape (arcs,)

    def certificate(self, unit: float, parts: int, branched: int = 0) -> Certificate:
        cuts = tuple((cut.object, m, tuple(np.flatnonzero(cut.inside).tolist())) for cut, m in self.cuts)
        prices = tuple(self.prices.tolist())
        return Certificate(
            Proof.CUTS, unit, self.value, multipliers=prices, cuts=cuts, parts=parts, branched=branched
        )


def root_bound(
    graph: StateGraph, parts: int, prices: NDArray[np.int64], cuts: Sequence[tuple[Cut, int]]
) -> RootBound:
    """Return a lower bound on tour lengths, for any prices of objects and any nonnegative multipliers of cuts.

    Every tour pays each price once, and gains nothing from a cut. The reduced length of an arc is its length less the
    price of the object at its head and less its coefficients times the multipliers. Node potentials, which are
    lengths of shortest walks from the root, make almost all reduced lengths nonnegative. Each remaining negative
    length counts as often as a tour can use the arc.
    """
    reduced = graph.length * parts - np.append(prices, 0)[graph.picks]
    for cut, multiplier in cuts:
        reduced -= multiplier * cut.coefficients(graph)
    potential = _potentials(graph, reduced)
    extra = reduced + potential[graph.tail] - potential[graph.head]
    total = int(potential[graph.end]) + int(prices.sum()) + int((graph.most * np.minimum(extra, 0)).sum())
    return RootBound(-(-total // parts), prices, tuple(cuts), total + extra)


def _potentials(graph: StateGraph, reduced: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return lengths of shortest walks with at most as many arcs as there are nodes."""
    far = np.iinfo(np.int64).max // 4
    potential = np.full(len(graph.object), far)
    potential[graph.root] = 0
    for _ in range(len(potential)):
        shorter = potential.copy()
        np.minimum.at(shorter, graph.head, potential[graph.tail] + reduced)
        if (shorter == potential).all():
            break
        potential = shorter
    return potential
