"""Check that the exact planner's result does not depend on concurrent threads or on their number."""

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from planner.exact.solver import ExactSolver
from planner.problem import RoutingProblem, Shipment
from planner.solvers import SolveLimit

SEARCH = ExactSolver(table_bytes=0, passes=((60, 300), (200, 600)))

IN_ANOTHER_PROCESS = """
import sys
import numpy as np
from planner.exact.solver import ExactSolver
from planner.problem import RoutingProblem, Shipment
d = np.load(sys.stdin.buffer)
problem = RoutingProblem(d, 0, tuple(Shipment(7 + k, 1 + k % 6) for k in range(len(d) - 7)))
plan = ExactSolver(table_bytes=0, passes=((60, 300), (200, 600))).solve(problem, seed=3)
print([*map(str, plan.visits)], plan.lower_bound.hex())
"""


def problem_of(seed, n=16):
    places = np.random.default_rng(seed).uniform(0, 10, (7 + n, 2))
    d = np.hypot(*(places[:, None] - places[None]).transpose(2, 0, 1))
    return RoutingProblem(d, 0, tuple(Shipment(7 + k, 1 + k % 6) for k in range(n)))


def claim(plan):
    """Return all attributes of a plan except its computation time."""
    return plan.visits, plan.cost, plan.lower_bound, plan.status, plan.certificate


def test_threads_that_solve_at_once_do_not_disturb_each_other():
    problems = [problem_of(seed) for seed in range(4)]
    alone = [claim(SEARCH.solve(p, seed=3, limit=SolveLimit(work=60_000))) for p in problems]
    for threads in (2, 8):
        with ThreadPoolExecutor(threads) as pool:
            together = pool.map(
                lambda p: claim(SEARCH.solve(p, seed=3, limit=SolveLimit(work=60_000))), problems * 3
            )
            assert list(together) == alone * 3


@pytest.mark.slow
def test_a_process_with_another_number_of_threads_finds_the_same_plan(tmp_path):
    problem = problem_of(11)
    np.save(tmp_path / "distances.npy", problem.distances)
    names = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")
    with (tmp_path / "distances.npy").open("rb") as distances:
        printed = subprocess.run(
            [sys.executable, "-c", IN_ANOTHER_PROCESS],
            stdin=distances,
            env=os.environ | dict.fromkeys(names, "7"),
            capture_output=True,
            text=True,
            check=True,
        ).stdout
    plan = SEARCH.solve(problem, seed=3)
    assert printed.strip() == f"{[*map(str, plan.visits)]} {plan.lower_bound.hex()}"
