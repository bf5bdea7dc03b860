"""The interface of solvers, their limits, and their names."""

import importlib
import math
import pkgutil
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol, cast

from planner.errors import PlannerError

if TYPE_CHECKING:  # the command line imports this module and must not load NumPy
    from planner.plan import Plan
    from planner.problem import RoutingProblem

# Name -> module and class. To add a planner, add its module and an entry here.
SOLVERS = {
    "exact": ("planner.exact.solver", "ExactSolver"),
    "ortools": ("planner.ortools_solver", "OrToolsSolver"),
    "greedy": ("planner.greedy_solver", "GreedySolver"),
}
DEFAULT_SOLVER = "exact"
PATIENT_WORK = 60_000_000  # budget of the exact search for offline use, states; about 30 s with 30 objects


@dataclass(frozen=True)
class SolveLimit:
    """Limit of a search.

    Attributes:
        work: Amount of work in the solver's own unit. Results are bit-identical on every machine.
        seconds: Wall time. Results depend on the machine.
        stop: Event that stops the solver soon, set by another thread.
    """

    work: int | None = None
    seconds: float | None = None
    stop: threading.Event | None = None

    def __post_init__(self) -> None:
        for name, value in (("work", self.work), ("seconds", self.seconds)):
            if value is not None and not 0 < value < math.inf:
                raise PlannerError(f"SolveLimit.{name} must be positive and finite, or None; got {value}")

    @property
    def stopped(self) -> bool:
        return self.stop is not None and self.stop.is_set()


@dataclass(frozen=True)
class Deadline:
    """A point in time of `time.perf_counter()` (None means never), or an event that another thread sets."""

    at: float | None
    stop: threading.Event | None = None

    def over(self) -> bool:
        stopped = self.stop is not None and self.stop.is_set()
        return stopped or (self.at is not None and time.perf_counter() >= self.at)


NEVER = Deadline(None)


class Solver(Protocol):
    """A planner for routing problems."""

    @property
    def name(self) -> str:
        """Name in run records."""

    def solve(self, problem: "RoutingProblem", *, seed: int = 0, limit: SolveLimit | None = None) -> "Plan":
        """Return a plan. Without a limit on time, the same arguments give the same visits."""

    def improve(
        self, problem: "RoutingProblem", *, seed: int = 0, limit: SolveLimit | None = None
    ) -> "Iterator[Plan]":
        """Yield a first plan at once, then each plan that is shorter or has a better bound.

        The last plan is the result of `solve` for the same arguments, except with limits on time. The caller may stop
        the iteration at any time.
        """


def solver(name: str) -> Solver:
    """Return the planner of this name, or of `package.module:attribute`: a class, or a function without arguments.

    Raises:
        PlannerError: There is no such planner, or it cannot be made.

    Example:
        >>> import numpy as np
        >>> from planner.problem import RoutingProblem, Shipment
        >>> distances = np.array([[0.0, 3.0, 5.0], [3.0, 0.0, 4.0], [5.0, 4.0, 0.0]])
        >>> plan = solver("exact").solve(RoutingProblem(distances, 0, (Shipment(1, 2),), names=("mug",)))
        >>> plan.cost, plan.status.value, [(visit.kind.value, visit.object) for visit in plan.visits]
        (7.0, 'optimal', [('pick', 'mug'), ('place', 'mug')])
    """
    if name in SOLVERS:
        module, attribute = SOLVERS[name]
        return cast(Solver, getattr(importlib.import_module(module), attribute)())
    if ":" not in name:
        raise PlannerError(
            f"unknown solver {name!r}; choose one of {sorted(SOLVERS)}, or package.module:attribute"
        )
    try:
        found = pkgutil.resolve_name(name)()
    except (Exception, SystemExit) as error:  # user code may raise anything on import
        raise PlannerError(
            f"cannot make the planner {name!r}: {type(error).__name__}: {error}; "
            "modules are searched for in the current folder and among those installed"
        ) from error
    if not callable(getattr(found, "solve", None)):
        raise PlannerError(f"planner {name!r} makes a {type(found).__name__}, which has no method solve")
    return cast(Solver, found)
