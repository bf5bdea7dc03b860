"""Solves routing problems with one planner in a process of its own, so that memory and CPU time are that planner's.

Called by the planner benchmark: reads a pickled list of problems, writes a line of JSON per problem.
Run with `python -P`, as this folder has a module named like the package that it measures.
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

from planner.problem import RoutingProblem
from planner.solvers import PATIENT_WORK, SolveLimit, solver

# Length of a tour in m (None: found none), its lower bound in m if the planner gives one, whether it is proven.
Answer = tuple[float | None, float | None, bool]
Method = Callable[[RoutingProblem], Answer]


def main() -> None:
    """Arguments: a planner, its limit of seconds (0: none), the file of problems."""
    name, limit, path = sys.argv[1], float(sys.argv[2]), sys.argv[3]
    solve = method(name, limit)
    problems: list[RoutingProblem] = pickle.loads(Path(path).read_bytes())
    if name == "exact":
        import planner.exact.table_kernels  # noqa: F401 - or it plans a few objects without its kernels
    solve(problems[0])  # loads the compiled kernels and the libraries
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
    """Most memory that this process ever had; getrusage would count the process that started it as well."""
    found = re.search(r"VmHWM:\s+(\d+) kB", Path("/proc/self/status").read_text(encoding="ascii"))
    return int(found[1]) / 1024 if found else float("nan")


def method(name: str, limit: float) -> Method:
    """The planner of a name, limited to seconds."""
    if name == "pyvrp":
        return lambda problem: by_pyvrp(problem, limit)
    if name == "vroom":
        return by_vroom
    planner = solver(name)
    chosen = (
        SolveLimit(seconds=limit) if limit else SolveLimit(work=PATIENT_WORK) if name == "exact" else None
    )

    def by_own(problem: RoutingProblem) -> Answer:
        plan = planner.solve(problem, limit=chosen)
        return plan.cost, plan.lower_bound, plan.status.value == "optimal"

    return by_own


def by_pyvrp(problem: RoutingProblem, seconds: float) -> Answer:
    """PyVRP: one vehicle, shipments, a depot at no distance to end at. Nothing may be carried at the start."""
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
    """VROOM at its greatest exploration level: an open route. Nothing may be carried at the start."""
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
