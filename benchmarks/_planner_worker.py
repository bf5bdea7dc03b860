"""A worker process that solves routing problems with one planner, to isolate its memory and CPU time.

The planner benchmark passes a pickled list of problems and reads a line of JSON for each problem. Run it with
`python -P`, because a module in this folder has the same name as a package that is measured.
"""

import json
import pickle
import re
import sys
import time
from collections.abc import Callable
from datetime import timedelta
from pathlib import Path
from typing import Any

import numpy as np

from planner.exact.instance import MAX_SEARCHED
from planner.exact.solver import ExactSolver
from planner.problem import RoutingProblem
from planner.solvers import PATIENT_WORK, SolveLimit, solver

# Length of a tour in m or None, lower bound in m or None, and whether the tour is proven to be optimal
Answer = tuple[float | None, float | None, bool]
Method = Callable[[RoutingProblem], Answer]
EXACT = {
    "exact": ExactSolver(),
    "search": ExactSolver(table_bytes=0, most_searched=MAX_SEARCHED),
    "cuts": ExactSolver(table_bytes=0, most_searched=0),
}


def main() -> None:
    """Solve all problems, given a planner, its time limit in seconds (0 for none), and the problem file."""
    name, limit, path = sys.argv[1], float(sys.argv[2]), sys.argv[3]
    solve = method(name, limit)
    problems: list[RoutingProblem] = pickle.loads(Path(path).read_bytes())
    if name in EXACT:
        import planner.exact.table_kernels  # noqa: F401 - otherwise small problems are solved without kernels
    solve(problems[0])  # compile the kernels and load the libraries before the measurement
    for problem in problems:
        wall, cpu = time.perf_counter(), time.process_time()
        cost, bound, proven = solve(problem)
        record = {
            "cost": cost,
            "bound": bound,
            "proven": proven,
            "wall": time.perf_counter() - wall,
            "cpu": time.process_time() - cpu,
            "peak_mb": peak_mb(),
        }
        print(json.dumps(record), flush=True)


def peak_mb() -> float:
    """Return the peak memory of this process in MB. `getrusage` would also count the parent process."""
    found = re.search(r"VmHWM:\s+(\d+) kB", Path("/proc/self/status").read_text(encoding="ascii"))
    return int(found[1]) / 1024 if found else float("nan")


def method(name: str, limit: float) -> Method:
    if name == "pyvrp":
        return lambda problem: by_pyvrp(problem, limit)
    if name == "vroom":
        return by_vroom
    planner = EXACT[name] if name in EXACT else solver(name)
    chosen = SolveLimit(seconds=limit) if limit else SolveLimit(work=PATIENT_WORK) if name in EXACT else None

    def by_own(problem: RoutingProblem) -> Answer:
        plan = planner.solve(problem, limit=chosen)
        return plan.cost, plan.lower_bound, plan.status.value == "optimal"

    return by_own


def by_pyvrp(problem: RoutingProblem, seconds: float) -> Answer:
    """Solve a problem with PyVRP. An extra depot at distance 0 from all places lets the tour end anywhere."""
    import pyvrp
    from pyvrp.stop import MaxRuntime

    metric = problem.integers.metric
    model = pyvrp.Model()
    places = [model.add_location(float(k), 0.0) for k in range(len(metric))]
    nowhere = model.add_location(-1.0, 0.0)
    for i, row in enumerate(metric.tolist()):
        for j, leg in enumerate(row):
            model.add_edge(places[i], places[j], distance=leg)
        model.add_edge(places[i], nowhere, distance=0)
    start, end = model.add_depot(places[problem.start]), model.add_depot(nowhere)
    model.add_vehicle_type(1, capacity=problem.capacity, start_depot=start, end_depot=end)
    for s in problem.shipments:
        model.add_shipment(places[s.pickup], places[s.delivery], amount=1)
    result = model.solve(MaxRuntime(seconds), display=False)
    return (result.cost() * problem.integers.unit if result.is_feasible() else None), None, False


def by_vroom(problem: RoutingProblem) -> Answer:
    """Solve a problem with VROOM at its highest exploration level. The tour may end anywhere."""
    import vroom

    task: Any = vroom.Input()
    locomotion = problem.integers.metric.astype(np.uint32)
    task.set_durations_matrix("car", locomotion)
    task.set_costs_matrix("car", locomotion)
    task.add_vehicle(vroom.Vehicle(1, start=problem.start, capacity=[problem.capacity]))
    for k, s in enumerate(problem.shipments):
        task.add_shipment(
            vroom.ShipmentStep(k, location=s.pickup),
            vroom.ShipmentStep(k, location=s.delivery),
            amount=vroom.Amount([1]),
        )
    found = task.solve(exploration_level=5, nb_threads=1, timeout=timedelta(seconds=60))
    return (found.summary.cost * problem.integers.unit if not found.summary.unassigned else None), None, False


if __name__ == "__main__":
    main()
