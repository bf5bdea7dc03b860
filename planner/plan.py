"""Plans, and certificates of their lower bounds."""

import enum
import math
import numbers
from dataclasses import dataclass
from typing import NamedTuple

from planner.errors import ProblemError


class Proof(enum.Enum):
    """Type of proof of a lower bound.

    EXHAUSTIVE: Every order of visits was tried, or was excluded because it cannot be shorter.
    FULL_TABLE: The cost-to-go was computed for every set of remaining objects.
    RELAXATION: The cost-to-go was computed for a relaxed problem, which counts objects by group and puts a price on
        each pick. If the plan's bound exceeds the relaxation's, a search excluded all states that cannot lead to a
        shorter tour.
    SPANNING_TREE: No tour is shorter than the minimum spanning tree of its locations.
    """

    EXHAUSTIVE = "exhaustive"
    FULL_TABLE = "full-table"
    RELAXATION = "relaxation"
    SPANNING_TREE = "spanning-tree"


@dataclass(frozen=True)
class Certificate:
    """Proof of a lower bound on the shortest tour, in whole units of the rounded distances."""

    proof: Proof
    unit: float  # length of a unit in metres
    # lower bound in units before any search: the optimum (full table, exhaustive), the relaxation's bound at the start,
    # or the spanning tree's length. The plan's lower bound is higher if a search has raised it.
    root: int
    # groups of shipments that the relaxation counts together; each shipment is in one group
    groups: tuple[tuple[int, ...], ...] = ()
    multipliers: tuple[int, ...] = ()  # price of picking up each shipment, in units


class Status(enum.Enum):
    """Quality of a plan."""

    OPTIMAL = "optimal"
    FEASIBLE = "feasible"
    INFEASIBLE = "infeasible"


class VisitKind(enum.StrEnum):
    """Type of a visit."""

    PICK = "pick"
    PLACE = "place"


class Visit(NamedTuple):
    """One step of a task."""

    kind: VisitKind
    object: str  # name of the object


@dataclass(frozen=True)
class Plan:
    """A feasible order of all remaining visits.

    Attributes:
        visits: Visits in order.
        cost: Length of the open tour in metres.
        lower_bound: Lower bound on all feasible tours in metres.
        status: OPTIMAL if and only if cost equals lower_bound up to rounding.
        seconds: Wall time of the search. It is not reproducible.
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
        """Return True if this plan is shorter than another, has a higher lower bound, or differs in status."""
        shorter = self.cost < other.cost - 1e-9
        return shorter or self.lower_bound > other.lower_bound + 1e-9 or self.status is not other.status
