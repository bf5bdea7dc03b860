"""Warm starts: results of plans for similar problems.

Any multipliers give a lower bound, for any objects left at any places. So those of one state of a task serve all
later ones, and only the table has to be filled again for the objects left.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.plan import Plan, Proof, VisitKind
from planner.problem import RoutingProblem


class Start(NamedTuple):
    """A warm start with objects numbered as in an instance."""

    group: NDArray[np.int64]  # group of each object, numbered from 0, (n,)
    multipliers: NDArray[np.int64]  # price of picking each object, units, (n,)
    order: list[int]  # numbers of objects in the order of a good tour
    missing: list[int]  # numbers of the objects that are not in the order


@dataclass(frozen=True)
class WarmStart:
    """Results of earlier plans, by object name."""

    multipliers: Mapping[str, float]  # price of picking an object in the relaxation, m
    groups: tuple[tuple[str, ...], ...] = ()  # objects that the relaxation counts together
    order: tuple[str, ...] = ()  # objects in the order in which a good tour may pick them

    def updated(self, problem: RoutingProblem, plan: Plan) -> "WarmStart":
        """Return this warm start with the results of one more plan. Multipliers of other objects stay."""
        order = tuple(name for kind, name in plan.visits if kind is VisitKind.PICK)
        certificate = plan.certificate
        if certificate is None or certificate.proof is not Proof.RELAXATION:
            return WarmStart(self.multipliers, self.groups, order)
        names = problem.names
        new = {names[k]: price * certificate.unit for k, price in enumerate(certificate.multipliers)}
        groups = tuple(tuple(names[k] for k in members) for members in certificate.groups)
        return WarmStart({**self.multipliers, **new}, groups, order)

    def numbered(self, names: Sequence[str], unit: float) -> Start | None:
        """Return the warm start for an instance with objects of these names, in its unit, m.

        None if no multiplier of these objects is known. A new object gets the mean price and joins the first group.
        """
        prices = {name: round(price / unit) for name, price in self.multipliers.items()}
        found = [prices[name] for name in names if name in prices]
        if not found:
            return None
        average = sum(found) // len(found)
        number = {name: k for k, name in enumerate(names)}
        group = np.zeros(len(names), np.int64)
        for g, members in enumerate(self.groups):
            group[[number[name] for name in members if name in number]] = g
        order = [number[name] for name in self.order if name in number]
        return Start(
            np.unique(group, return_inverse=True)[1],
            np.array([prices.get(name, average) for name in names], np.int64),
            order,
            sorted(set(range(len(names))) - set(order)),
        )


NOTHING_KNOWN = WarmStart({})
