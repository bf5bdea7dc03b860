"""Typed errors of the planner.

    PlannerError
    ├── NotNavigableError   no navigable point near a position
    ├── UnreachableError    two positions lie on different islands of the navmesh
    ├── ProblemError        a routing problem is malformed
    └── InfeasibleError     a well-formed problem has no feasible plan
"""


class PlannerError(Exception):
    """Base of every error raised by :mod:`planner`."""


class NotNavigableError(PlannerError):
    """No navigable point lies near a position."""


class UnreachableError(PlannerError):
    """Two positions lie on different islands of the navmesh."""


class ProblemError(PlannerError):
    """A routing problem is malformed."""


class InfeasibleError(PlannerError):
    """A well-formed problem has no feasible plan."""
