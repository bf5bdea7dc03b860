"""Navmesh, geodesic distances, and the routing problem of a task with its planners.

The package works with distances and names only. Sessions use `Planner`, and `mjsim plan` uses `solver`.
"""

from typing import TYPE_CHECKING

__all__ = [
    "Geodesics",
    "Mode",
    "NavMesh",
    "Plan",
    "Planner",
    "PlannerError",
    "Regret",
    "RegretEvaluator",
    "RoutingProblem",
    "Shipment",
    "SolveLimit",
    "Solver",
    "SolverSource",
    "Status",
    "TaskState",
    "Visit",
    "VisitKind",
    "possible_next",
    "solver",
    "tour_length",
]

if TYPE_CHECKING:
    from planner.errors import PlannerError
    from planner.geodesics import Geodesics
    from planner.navmesh import NavMesh
    from planner.plan import Plan, Status, Visit, VisitKind
    from planner.problem import RoutingProblem, Shipment, possible_next, tour_length
    from planner.regret import Regret, RegretEvaluator
    from planner.route import TaskState
    from planner.service import Mode, Planner
    from planner.solver_source import SolverSource
    from planner.solvers import SolveLimit, Solver, solver
else:  # hidden from type checkers, which would otherwise accept any name
    _MODULES = {
        "errors": ("PlannerError",),
        "geodesics": ("Geodesics",),
        "navmesh": ("NavMesh",),
        "plan": ("Plan", "Status", "Visit", "VisitKind"),
        "problem": ("RoutingProblem", "Shipment", "possible_next", "tour_length"),
        "regret": ("Regret", "RegretEvaluator"),
        "route": ("TaskState",),
        "service": ("Mode", "Planner"),
        "solver_source": ("SolverSource",),
        "solvers": ("SolveLimit", "Solver", "solver"),
    }

    def __getattr__(name):
        import importlib

        for module, names in _MODULES.items():
            if name in names:
                return getattr(importlib.import_module(f"planner.{module}"), name)
        raise AttributeError(f"module 'planner' has no attribute {name!r}; its public names are {__all__}")

    def __dir__():
        return sorted({*globals(), *__all__})
