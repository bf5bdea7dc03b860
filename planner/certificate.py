"""What proves the lower bound of a plan, in a form that can be checked independently."""

import enum
from dataclasses import dataclass


class Proof(enum.Enum):
    """How a lower bound was found.

    EXHAUSTIVE: every order of visits was tried, or left out because it cannot be shorter.
    FULL_TABLE: the cost-to-go of every set of objects left was computed.
    RELAXATION: the same for a relaxed problem that counts objects by groups only, with a price on each pick;
        where the bound exceeds the relaxation's, a search left out only states that cannot lead to a shorter tour.
    SPANNING_TREE: a tour connects all its locations.
    """

    EXHAUSTIVE = "exhaustive"
    FULL_TABLE = "full-table"
    RELAXATION = "relaxation"
    SPANNING_TREE = "spanning-tree"


@dataclass(frozen=True)
class Certificate:
    """A claim about the shortest tour, in whole units of length and the metric of distances rounded to these."""

    proof: Proof  # how the bound was found
    unit: float  # m per unit
    # bound that the proof gives without a search, units: the optimum by the table or by trying all, the
    # relaxation at the start of the tour, the length of the spanning tree. A plan's lower bound that is higher
    # rests on the solver's search being complete.
    root: int
    # shipments that the relaxation counts together, each in one group
    groups: tuple[tuple[int, ...], ...] = ()
    multipliers: tuple[int, ...] = ()  # price of picking each shipment in the relaxation, units
