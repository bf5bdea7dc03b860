"""Bounds from a certificate: prices of picks found for one state of a task serve every other one.

Any prices give a lower bound, for any objects left, wherever they lie. So what was learnt once carries over to every
later replan; only the table has to be filled anew, with the objects that are left.
"""

from dataclasses import dataclass

import numpy as np

from planner.certificate import Certificate, Proof
from planner.errors import ProblemError
from planner.exact.instance import Instance
from planner.exact.multipliers import Bound
from planner.exact.relaxation import fill, new_table, walk

STEP = 0.2  # where fitting goes on from, if it does


@dataclass(frozen=True)
class Warm:
    """What is known from a similar problem, in the numbering of the shipments of the one to solve.

    Attributes:
        certificate: A relaxation with a price for each shipment.
        order: All shipments in the order in which a good tour may pick them.

    Raises:
        ProblemError: The certificate is of another kind, or the two are not about the same shipments.
    """

    certificate: Certificate
    order: tuple[int, ...]

    def __post_init__(self) -> None:
        count = len(self.certificate.multipliers)
        if self.certificate.proof is not Proof.RELAXATION or sorted(self.order) != list(range(count)):
            raise ProblemError(
                f"{self.certificate.proof.value} with {count} prices does not go with the order {self.order}; "
                "give a relaxation and each shipment once"
            )


def warm_bound(instance: Instance, certificate: Certificate, most_exact: int) -> Bound:
    """The bound that a certificate's subset and prices give, by one filling of a table.

    Args:
        instance: What is left to do; its objects are numbered as the certificate's shipments.
        certificate: A relaxation.
        most_exact: How many objects of its subset to keep exactly; the first ones matter most.
    """
    n = len(instance.home)
    exact = certificate.exact[: min(most_exact, n)]
    order = (*exact, *(k for k in range(n) if k not in exact))
    permuted = instance.permuted(order)
    table = new_table(permuted, len(exact))
    table.multipliers[:] = np.array(certificate.multipliers, dtype=np.int32)[list(order)]
    fill(permuted, table)
    total, _ = walk(permuted, table, np.empty(2 * n + 2, np.int64))
    root = int(total) - int(table.multipliers.sum())
    return Bound(order, permuted, table, root, np.zeros(n), STEP)
