from .errors import PlannerError
from .geodesics import Geodesics
from .navmesh import NavMesh
from .plan import Plan, Status, Visit, VisitKind
from .problem import RoutingProblem, Shipment, possible_next, tour_length
from .regret import Regret, RegretEvaluator
from .route import TaskState
from .service import Planner
from .solver_source import SolverSource
from .solvers import SolveLimit, Solver, solver

__all__ = [
    "Geodesics",
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
