"""Bounds from a certificate: prices of picks found for one state of a task serve every other one.

Any prices give a lower bound, for any objects left, wherever they lie. So what was learnt once carries over to every
later replan; only the table has to be filled anew, with the objects that are left.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from planner.certificate import Certificate, Proof
from planner.errors import ProblemError
from planner.exact.annealing import decode
from planner.exact.groups import together
from planner.exact.instance import Instance
from planner.exact.multipliers import Bound
from planner.exact.relaxation import fill, walk
from planner.exact.table import new_table, rows_of

T = TypeVar("T", str, int)


@dataclass(frozen=True)
class Warm:
    """What is known from a similar problem, in the numbering of the shipments of the one to solve.

    Attributes:
        certificate: A relaxation with a price for each shipment.
        order: All shipments in the order in which a good tour may pick them.
        astray: Shipments whose place in the order says nothing, because they lie elsewhere now or are new.

    Raises:
        ProblemError: The certificate is of another kind, or the two are not about the same shipments.
    """

    certificate: Certificate
    order: tuple[int, ...]
    astray: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        count = len(self.certificate.multipliers)
        if self.certificate.proof is not Proof.RELAXATION or sorted(self.order) != list(range(count)):
            raise ProblemError(
                f"{self.certificate.proof.value} with {count} prices does not go with the order {self.order}; "
                "give a relaxation and each shipment once"
            )


def warm_order(instance: Instance, warm: Warm) -> NDArray[np.int64]:
    """The known order, each object that is astray moved to where it lengthens the tour least."""
    n = len(instance.home)
    order = [k for k in warm.order if k not in warm.astray] + [k for k in warm.order if k in warm.astray]
    costs = np.empty((n + 1, len(instance.bins) + 1), np.int32)
    for k in warm.astray:
        rest = [j for j in order if j != k]
        ways = [[*rest[:t], k, *rest[t:]] for t in range(n)]
        order = min(ways, key=lambda way: decode(instance, np.array(way, dtype=np.int64), 0, costs))
    return np.array(order, dtype=np.int64)


def same_groups(groups: Sequence[Sequence[T]], names: Sequence[T]) -> tuple[tuple[int, ...], ...]:
    """Groups of a certificate for what is left of its shipments.

    Args:
        groups: Names of shipments that are counted together.
        names: Names of the shipments that are left, in their new order; new ones are put into the first group.
    """
    number = {name: k for k, name in enumerate(names)}
    kept = [[number.pop(name) for name in members if name in number] for members in groups] or [[]]
    kept[0] += number.values()
    return tuple(tuple(members) for members in kept if members)


def warm_bound(instance: Instance, certificate: Certificate, most_rows: int) -> Bound:
    """The bound that a certificate's groups and prices give, by one filling of a table.

    Args:
        instance: What is left to do; its objects are numbered as the certificate's shipments.
        certificate: A relaxation; its last groups are merged with the first if they are too many.
        most_rows: Of the table.
    """
    n = len(instance.home)
    group = together(n)
    for g, members in enumerate(certificate.groups):
        group[list(members)] = g
    while rows_of(group) > most_rows and group.max(initial=0) > 0:
        group[group == group.max()] = 0
    table = new_table(instance, group)
    table.multipliers[:] = certificate.multipliers
    fill(instance, table)
    total, _ = walk(instance, table, np.empty(2 * n + 2, np.int64))
    return Bound(instance, table, int(total) - int(table.multipliers.sum()), np.zeros(n))
