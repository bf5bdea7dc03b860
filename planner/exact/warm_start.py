"""Warm starts, which reuse the results of earlier plans for similar problems.

Multipliers give a valid lower bound for any set of remaining objects, so they can be reused in all later
states of a task. Only the table must be filled again.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.plan import Plan, Proof, VisitKind
from planner.problem import RoutingProblem


class Start(NamedTuple):
    """A warm start in which objects are identified by their indices in an instance."""

    group: NDArray[np.int64]  # group of each object, numbered from 0, shape (n,)
    multipliers: NDArray[np.int64]  # price in units for picking up each object, shape (n,)
    order: list[int]  # indices of known objects, in the order in which a good tour picks them up


@dataclass(frozen=True)
class WarmStart:
    """The results of earlier plans, in which objects are identified by name."""

    multipliers: Mapping[str, float]  # price of picking up each object in the relaxation, in metres
    # Groups of objects, of which the relaxation knows only how many remain
    groups: tuple[tuple[str, ...], ...] = ()
    order: tuple[str, ...] = ()  # object names in the order in which a good tour picks them up

    def updated(self, problem: RoutingProblem, plan: Plan) -> "WarmStart":
        """Return a copy that includes the results of another plan. Multipliers of other objects are kept."""
        order = tuple(name for kind, name in plan.visits if kind is VisitKind.PICK)
        certificate = plan.certificate
        if certificate is None or certificate.proof is not Proof.RELAXATION:
            return WarmStart(self.multipliers, self.groups, order)
        names = problem.names
        new = {names[k]: price * certificate.unit for k, price in enumerate(certificate.multipliers)}
        groups = tuple(tuple(names[k] for k in members) for members in certificate.groups)
        return WarmStart({**self.multipliers, **new}, groups, order)

    def numbered(self, names: Sequence[str], unit: float) -> Start | None:
        """Replace object names by indices, for an instance with the given names and a unit in metres.

        Return None if no multiplier of these objects is known. New objects get the mean price and join the first group.
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
        return Start(
            np.unique(group, return_inverse=True)[1],
            np.array([prices.get(name, average) for name in names], np.int64),
            [number[name] for name in self.order if name in number],
        )


NOTHING_KNOWN = WarmStart({})
