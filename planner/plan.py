"""Plans and the certificates that prove their lower bounds."""

import enum
import math
import numbers
from dataclasses import dataclass, replace
from typing import NamedTuple

from planner.errors import ProblemError


class Proof(enum.Enum):
    """Methods that prove a lower bound.

    EXHAUSTIVE: All orders of visits were tried, except those that could not be shorter.
    FULL_TABLE: The cost-to-go was computed for every set of remaining objects.
    RELAXATION: The cost-to-go was computed for a relaxed problem, which counts objects by group and assigns a
        price to each pick. If the plan's bound is higher than that of the relaxation, a search has examined
        all states that could lead to a tour shorter than the plan's bound.
    CUTS: The tour was relaxed to a flow in the graph of states, and connectivity cuts were added. If the plan's bound
        is higher than that of the cuts, branch and bound in floating-point numbers has raised it.
    SPANNING_TREE: The bound is the length of the minimum spanning tree of all locations of the tour.
    """

    EXHAUSTIVE = "exhaustive"
    FULL_TABLE = "full-table"
    RELAXATION = "relaxation"
    CUTS = "cuts"
    SPANNING_TREE = "spanning-tree"


@dataclass(frozen=True)
class Certificate:
    """A certificate that proves a lower bound on the tour length. Lengths are in integer units."""

    proof: Proof
    unit: float  # length of one unit in metres
    # Lower bound in units before any search: the optimal length (full table, exhaustive), the bound of the
    # relaxation or of the cuts, or the length of the spanning tree. A search may have raised the plan's bound further.
    root: int
    # Groups of shipments. The relaxation only counts the remaining shipments of each group.
    groups: tuple[tuple[int, ...], ...] = ()
    multipliers: tuple[int, ...] = ()  # price for picking up each shipment, in units divided by `parts`
    # Each cut is an object, a multiplier in units divided by `parts`, and a set of nodes of the graph of states, as
    # numbered in `planner.cuts_checker`. The set is entered at least as often as the object is picked up in it.
    cuts: tuple[tuple[int, int, tuple[int, ...]], ...] = ()
    parts: int = 1
    branched: int = 0  # number of nodes of branch and bound, which no checker repeats


class Status(enum.Enum):
    """Status of a plan: proven optimal, feasible, or infeasible."""

    OPTIMAL = "optimal"
    FEASIBLE = "feasible"
    INFEASIBLE = "infeasible"


class VisitKind(enum.StrEnum):
    """The kind of a visit: picking up or placing an object."""

    PICK = "pick"
    PLACE = "place"


class Visit(NamedTuple):
    """One step of a plan, in which an object is picked up or placed."""

    kind: VisitKind
    object: str  # name of the object


@dataclass(frozen=True)
class Plan:
    """A sequence of visits that completes the task.

    Attributes:
        visits: All remaining visits in order.
        cost: Length of the open tour in metres.
        lower_bound: Lower bound on the length of any feasible tour in metres.
        status: OPTIMAL if and only if `cost` equals `lower_bound` up to rounding.
        seconds: Wall time of the search in seconds, which differs from run to run.
        certificate: Proof of the lower bound, or None if it is not available.

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

    def bounded(self, lower_bound: float, tolerance: float) -> "Plan":
        """Return this plan with another lower bound, as OPTIMAL if it is longer by at most `tolerance` metres."""
        optimal = self.cost - lower_bound <= tolerance
        status = Status.OPTIMAL if optimal else Status.FEASIBLE
        return replace(self, lower_bound=self.cost if optimal else lower_bound, status=status)

    def improves_on(self, other: "Plan") -> bool:
        """Return True if this plan is shorter than another, has a higher lower bound, or differs in status."""
        shorter = self.cost < other.cost - 1e-9
        return shorter or self.lower_bound > other.lower_bound + 1e-9 or self.status is not other.status
