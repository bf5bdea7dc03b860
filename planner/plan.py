"""A plan: the order of visits, what it costs and how far from optimal it can be."""

import enum
import math
import numbers
from dataclasses import dataclass
from typing import NamedTuple

from planner.certificate import Certificate
from planner.errors import ProblemError


class Status(enum.Enum):
    """How much is known of a plan."""

    OPTIMAL = "optimal"
    FEASIBLE = "feasible"
    INFEASIBLE = "infeasible"


class VisitKind(enum.StrEnum):
    """What is done at a visit."""

    PICK = "pick"
    PLACE = "place"


class Visit(NamedTuple):
    """One step of a task."""

    kind: VisitKind  # whether the object is picked, or placed where it belongs
    object: str  # name of the object


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

    Raises:
        ProblemError: A value is of another kind, or no finite number.
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
        """Whether it is shorter, or known to be closer to the shortest, by more than rounding."""
        shorter = self.cost < other.cost - 1e-9
        return shorter or self.lower_bound > other.lower_bound + 1e-9 or self.status is not other.status
