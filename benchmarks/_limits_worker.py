"""A worker process that measures how late the exact planner returns after its time limit.

The planner benchmark starts it with a number of solves, and reads a JSON object from it. Run it with `python -P`,
because a module in this folder has the same name as a package that is measured.
"""

import json
import sys
import time

import numpy as np

from benchmarks.support.planner_cases import BINS, random_problem
from planner.solvers import SolveLimit, solver

SIZES = (12, 18, 24, 30, 40, 60)
SHORTEST, LONGEST = 0.01, 2.0  # time limits, in seconds
PROBLEMS = 5  # number of problems of each size


def main() -> None:
    rng, planner = np.random.default_rng(0), solver("exact")
    problems = [random_problem(n, BINS, seed) for seed in range(PROBLEMS) for n in SIZES]
    for problem in problems[
        : len(SIZES)
    ]:  # compile the kernels and load the libraries before the measurement
        planner.solve(problem, limit=SolveLimit(seconds=0.5))
    late: dict[int, list[float]] = {n: [] for n in SIZES}
    for k in range(int(sys.argv[1])):
        n, problem = SIZES[k % len(SIZES)], problems[k % len(problems)]
        seconds = float(np.exp(rng.uniform(np.log(SHORTEST), np.log(LONGEST))))
        started = time.perf_counter()
        planner.solve(problem, limit=SolveLimit(seconds=seconds))
        late[n].append(time.perf_counter() - started - seconds)
    print(
        json.dumps(
            {str(n): figures(values) for n, values in late.items() if values}
            | {"all": figures([value for values in late.values() for value in values])}
        )
    )


def figures(late: list[float]) -> dict[str, float]:
    """Return the number of solves, and how many seconds after the limit they ended."""
    return {
        "solves": len(late),
        "late_median": float(np.median(late)),
        "late_p99": float(np.percentile(late, 99)),
        "late_max": max(late),
    }


if __name__ == "__main__":
    main()
