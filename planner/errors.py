"""Exceptions raised by the planner."""


class PlannerError(Exception):
    """Base class of all errors of :mod:`planner`."""


class NavMeshError(PlannerError):
    """The obstacles, bounds or sizes of a navmesh are invalid."""


class NotNavigableError(PlannerError):
    """No navigable point is near a position."""


class UnreachableError(PlannerError):
    """Two positions are on different islands of the navmesh.

    Attributes:
        names: Names of the unreachable objects, if known.
    """

    def __init__(self, message: str, names: tuple[str, ...] = ()) -> None:
        super().__init__(message)
        self.names = names


class ProblemError(PlannerError):
    """A routing problem is malformed, or a plan does not solve it."""


class InfeasibleError(PlannerError):
    """A well-formed problem has no feasible plan."""
