"""Compiles the planner's kernels ahead of the first plan; numba keeps them on disk for every later process.

Run once after installing: `python -m planner.warmup`.
"""

import numpy as np

from planner.exact.solver import ExactSolver
from planner.exact.warm import Warm
from planner.geodesics import Geodesics
from planner.navmesh import NavMesh
from planner.problem import RoutingProblem, Shipment
from planner.regret import regrets


def compile_kernels() -> None:
    """Run every kernel on a small case; seconds where they are compiled already, half a minute otherwise."""
    navmesh = NavMesh.build([[(1.0, 1.0), (2.0, 1.0), (2.0, 2.0), (1.0, 2.0)]], (0.0, 0.0, 3.0, 3.0))
    Geodesics(navmesh).shortest_path((0.5, 0.5), (2.5, 2.5))
    for table_bytes in (ExactSolver.table_bytes, 0):  # the full table, and the search
        ExactSolver(table_bytes=table_bytes).solve(_tour())
        regrets(_tour(), ExactSolver(table_bytes=table_bytes))
    searching = ExactSolver(table_bytes=0)
    plan = next(searching.improve(_tour()))
    if plan.certificate is not None:  # a first tour from what is known, as in live replanning
        next(searching.improve(_tour(), warm=Warm(plan.certificate, tuple(range(12)))))


def _tour() -> RoutingProblem:
    places = np.random.default_rng(0).random((16, 2))
    distances = np.linalg.norm(places[:, None] - places[None], axis=2)
    return RoutingProblem(distances, 0, tuple(Shipment(4 + k, 1 + k % 3) for k in range(12)), (), 2)


if __name__ == "__main__":
    compile_kernels()
