"""Typed errors of the planner.

    PlannerError
    ├── NavMeshError        obstacles, bounds or sizes that make no navmesh
    ├── NotNavigableError   no navigable point near a position
    ├── UnreachableError    two positions lie on different islands of the navmesh
    ├── ProblemError        a routing problem is malformed, or a plan does not solve it
    └── InfeasibleError     a well-formed problem has no feasible plan

Every message names the offending value and what to do about it.
"""


class PlannerError(Exception):
    """Base of every error raised by :mod:`planner`."""


class NavMeshError(PlannerError):
    """Obstacles, bounds or sizes that make no navmesh."""


class NotNavigableError(PlannerError):
    """No navigable point lies near a position."""


class UnreachableError(PlannerError):
    """Positions lie on different islands of the navmesh.

    Attributes:
        names: Names of the unreachable objects, where the caller speaks in names.
    """

    def __init__(self, message: str, names: tuple[str, ...] = ()) -> None:
        super().__init__(message)
        self.names = names


class ProblemError(PlannerError):
    """A routing problem is malformed, or a plan does not solve it."""


class InfeasibleError(PlannerError):
    """A well-formed problem has no feasible plan."""
