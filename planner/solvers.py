"""The interface of solvers, their search limits, and a registry of solvers by name."""

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

# Module and class of each solver, by name. To add a solver, write its module and add an entry here.
SOLVERS = {
    "exact": ("planner.exact.solver", "ExactSolver"),
    "ortools": ("planner.ortools_solver", "OrToolsSolver"),
    "greedy": ("planner.greedy_solver", "GreedySolver"),
}
DEFAULT_SOLVER = "exact"
PATIENT_WORK = 60_000_000  # maximum number of states in an exact search outside of live sessions


@dataclass(frozen=True)
class SolveLimit:
    """Limits of a search. A limit of None does not apply.

    Attributes:
        work: Maximum amount of work, in units defined by the solver. Results are the same on every machine.
        seconds: Maximum wall time in seconds. Results depend on the machine's speed.
        stop: Event that another thread sets to end the search early.
    """

    work: int | None = None
    seconds: float | None = None
    stop: threading.Event | None = None

    def __post_init__(self) -> None:
        for name, value in (("work", self.work), ("seconds", self.seconds)):
            if value is not None and not 0 < value < math.inf:
                raise PlannerError(f"SolveLimit.{name} must be positive and finite, or None; got {value}")


@dataclass(frozen=True)
class Deadline:
    """The end of a search, when `time.perf_counter()` reaches `at` or another thread sets `stop`."""

    at: float | None
    stop: threading.Event | None = None

    @classmethod
    def of(cls, limit: SolveLimit | None, started: float | None = None) -> "Deadline":
        """Return the end of a search with a limit. By default, the search starts now."""
        if limit is None:
            return cls(None)
        began = time.perf_counter() if started is None else started
        return cls(None if limit.seconds is None else began + limit.seconds, limit.stop)

    @property
    def left(self) -> float:
        """Time until the end in seconds, which is infinite without a time limit."""
        stopped = self.stop is not None and self.stop.is_set()
        return 0.0 if stopped else math.inf if self.at is None else max(0.0, self.at - time.perf_counter())

    def over(self) -> bool:
        return self.left == 0.0


NEVER = Deadline(None)


class Solver(Protocol):
    """The interface of planners for routing problems."""

    @property
    def name(self) -> str:
        """Name of the solver in run records."""

    def solve(self, problem: "RoutingProblem", *, seed: int = 0, limit: SolveLimit | None = None) -> "Plan":
        """Solve a problem. Without a time limit, the same arguments always give the same visits."""

    def improve(
        self, problem: "RoutingProblem", *, seed: int = 0, limit: SolveLimit | None = None
    ) -> "Iterator[Plan]":
        """Yield a first plan immediately, then every plan that is shorter or has a better lower bound.

        The last plan equals the result of `solve` for the same arguments, unless there is a time limit. The caller may
        stop iterating at any time.
        """


def solver(name: str) -> Solver:
    """Create a planner by name, or by calling the object `package.module:attribute` without arguments.

    Raises:
        PlannerError: No planner has this name, or creating it failed.

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
    except (Exception, SystemExit) as error:  # user code may raise any exception on import
        raise PlannerError(
            f"cannot make the planner {name!r}: {type(error).__name__}: {error}; "
            "modules are searched for in the current folder and among those installed"
        ) from error
    if not callable(getattr(found, "solve", None)):
        raise PlannerError(f"planner {name!r} makes {type(found).__name__}, which has no method solve")
    return cast(Solver, found)
