"""Exceptions raised by the planner."""


class PlannerError(Exception):
    """Base class of all exceptions raised by :mod:`planner`."""


class NavMeshError(PlannerError):
    """Raised if the obstacles, bounds or sizes of a navmesh are invalid."""


class NotNavigableError(PlannerError):
    """Raised if there is no navigable point near a position."""


class UnreachableError(PlannerError):
    """Raised if there is no path between two positions.

    Attributes:
        names: Names of the unreachable objects, if known.
    """

    def __init__(self, message: str, names: tuple[str, ...] = ()) -> None:
        super().__init__(message)
        self.names = names


class ProblemError(PlannerError):
    """Raised if a routing problem is malformed, or if a plan does not solve it."""
