"""Plans: visits in order, their cost, and the certificate of their lower bound."""

import enum
import math
import numbers
from dataclasses import dataclass
from typing import NamedTuple

from planner.errors import ProblemError


class Proof(enum.Enum):
    """Kind of proof of a lower bound.

    EXHAUSTIVE: Every order of visits was tried, or excluded because it cannot be shorter.
    FULL_TABLE: The cost-to-go of every set of objects left was computed.
    RELAXATION: The same for a relaxed problem that counts objects by groups, with a price on each pick. If the bound
        exceeds that of the relaxation, a search excluded only states that cannot lead to a shorter tour.
    SPANNING_TREE: A tour connects all its locations.
    """

    EXHAUSTIVE = "exhaustive"
    FULL_TABLE = "full-table"
    RELAXATION = "relaxation"
    SPANNING_TREE = "spanning-tree"


@dataclass(frozen=True)
class Certificate:
    """A claim about the shortest tour, in whole units of length and in the metric of rounded distances."""

    proof: Proof
    unit: float  # m per unit
    # lower bound without a search, units: the optimum (full table, exhaustive), the relaxation's bound at the start,
    # or the spanning tree's length. A plan's lower bound may be higher if the solver completed a search.
    root: int
    # groups of shipments that the relaxation counts together, each shipment in one group
    groups: tuple[tuple[int, ...], ...] = ()
    multipliers: tuple[int, ...] = ()  # price of picking each shipment, units


class Status(enum.Enum):
    """Quality of a plan."""

    OPTIMAL = "optimal"
    FEASIBLE = "feasible"
    INFEASIBLE = "infeasible"


class VisitKind(enum.StrEnum):
    """Kind of a visit."""

    PICK = "pick"
    PLACE = "place"


class Visit(NamedTuple):
    """One step of a task."""

    kind: VisitKind
    object: str  # name


@dataclass(frozen=True)
class Plan:
    """A feasible order of all remaining visits.

    Attributes:
        visits: Visits in order.
        cost: Length of the open tour, m.
        lower_bound: Lower bound of all feasible tours, m.
        status: OPTIMAL if and only if cost equals lower_bound up to rounding.
        seconds: Wall time of the search. Nothing reproducible may depend on it.
        certificate: Proof of the lower bound, or None for a plan read from a record.

    Raises:
        ProblemError: A value has the wrong type or is not finite.
    """

    visits: tuple[Visit, ...]
    cost: float
    lower_bound: float
    status: Status
    seconds: float
    certificate: Certificate | None = None

    def __post_init__(self) -> None:
        for name in ("cost", "lower_bound", "seconds"):
            value = getattr(self, name)
            if not isinstance(value, numbers.Real) or not math.isfinite(value):
                raise ProblemError(f"Plan.{name} must be a finite number, got {value!r}")
        if not isinstance(self.visits, tuple) or not all(isinstance(visit, Visit) for visit in self.visits):
            raise ProblemError(f"Plan.visits must be a tuple of Visit, got {self.visits!r:.200}")
        if not isinstance(self.status, Status):
            raise ProblemError(f"Plan.status must be a Status, got {self.status!r}")

    def improves_on(self, other: "Plan") -> bool:
        """Return True if this plan is shorter, or known to be closer to the shortest, by more than rounding."""
        shorter = self.cost < other.cost - 1e-9
        return shorter or self.lower_bound > other.lower_bound + 1e-9 or self.status is not other.status
