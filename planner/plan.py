"""A plan: the order of visits, what it costs and how far from optimal it can be."""

import enum
from dataclasses import dataclass

from planner.certificate import Certificate


class Status(enum.Enum):
    """How much is known of a plan."""

    OPTIMAL = "optimal"
    FEASIBLE = "feasible"
    INFEASIBLE = "infeasible"


class VisitKind(enum.Enum):
    """What is done at a visit."""

    PICK = "pick"
    PLACE = "place"


@dataclass(frozen=True)
class Visit:
    """One stop of the tour.

    Attributes:
        location: Index into the problem's distances.
        kind: Whether an object is picked or placed here.
        shipment: Index into the problem's shipments, or None for an onboard object.
        onboard: Index into the problem's onboard, or None for a shipment.
    """

    location: int
    kind: VisitKind
    shipment: int | None = None
    onboard: int | None = None


@dataclass(frozen=True)
class Plan:
    """A feasible order of all remaining visits.

    Attributes:
        visits: In order, without the start.
        cost: Length of the open tour, m.
        lower_bound: No feasible tour is shorter than this, m.
        status: OPTIMAL exactly when cost equals lower_bound up to rounding.
        seconds: Wall time it took to find; never used in anything that must repeat.
        certificate: What proves the lower bound; None for a plan that was read from a record.
    """

    visits: tuple[Visit, ...]
    cost: float
    lower_bound: float
    status: Status
    seconds: float
    certificate: Certificate | None = None

    def improves_on(self, other: "Plan") -> bool:
        """Whether it is shorter, or known to be closer to the shortest, by more than rounding."""
        shorter = self.cost < other.cost - 1e-9
        return shorter or self.lower_bound > other.lower_bound + 1e-9 or self.status is not other.status
