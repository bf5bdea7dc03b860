"""A worker process that measures how fast the planner replans for a person who ignores the plan.

The planner benchmark starts it with a number of objects and a number of houses, and reads a JSON object from
it. Run it with `python -P`, because a module in this folder has the same name as a package that is measured.
"""

import contextlib
import json
import sys
import time
from collections.abc import Iterator
from typing import Any

import numpy as np

from experiments.house import House
from planner.plan import Status, Visit, VisitKind
from planner.regret import RegretEvaluator
from planner.route import XY, Route, TaskState
from planner.service import Planner
from planner.solver_source import SolverSource
from planner.solvers import solver

REACH = 0.3  # standard deviation of the distance between the person and a visited place, in metres
LARGE = 15  # smallest number of objects for which the first plan comes from a search instead of a table


def main() -> None:
    objects, houses = int(sys.argv[1]), int(sys.argv[2])
    house = House.load("apartment")
    replans = [replan for seed in range(houses) for replan in task(house, objects, seed)]
    found = {"all": replans, f"{LARGE} or more left": [r for r in replans if r["left"] >= LARGE]}
    print(json.dumps({name: figures(group) for name, group in found.items() if group}))


def task(house: House, objects: int, seed: int) -> Iterator[dict[str, Any]]:
    """Run a task in which the person makes random visits. Yield measurements of each replan."""
    rng = np.random.default_rng([objects, seed])
    episode = house.sample_episode(objects=objects, seed=seed)
    approach = {key: xy(r.approach) for key, r in house.receptacles.items()}
    deliveries = {name: approach[key] for name, key in episode.targets.items()}
    loose = {o.name: (o.position[0], o.position[1]) for o in episode.objects}
    carried: list[str] = []
    source = SolverSource(house.geodesics, solver("exact"))
    with contextlib.closing(Planner(source, RegretEvaluator(house.geodesics), live=True)) as guide:
        guide.prepare(TaskState((episode.start.x, episode.start.y), dict(loose), (), deliveries))
        while len(loose) + len(carried) > 1:
            kind, name = possible(loose, carried)[int(rng.integers(len(possible(loose, carried))))]
            if kind is VisitKind.PICK:
                place = loose.pop(name)
                carried.append(name)
            else:
                place = deliveries[name]
                carried.remove(name)
            here = xy(house.navmesh.snap(np.array(place) + rng.normal(0.0, REACH, 2)))
            before = guide.replans
            record = replan(guide, TaskState(here, dict(loose), tuple(carried), deliveries))
            if guide.replans > before:
                yield record


def replan(guide: Planner, state: TaskState) -> dict[str, Any]:
    """Measure how long the caller waits for a plan, and how long the search continues in the background."""
    wall, own, cpu = time.perf_counter(), time.thread_time(), time.process_time()
    first = route(guide, state).plan.cost
    record = {"wall": time.perf_counter() - wall, "cpu": time.thread_time() - own}
    guide.wait()
    record |= {"proof_wall": time.perf_counter() - wall, "proof_cpu": time.process_time() - cpu}
    guide.improve(state)
    plan = route(guide, state).plan
    best = plan.cost
    gap = 100 * (first / best - 1) if best else 0.0
    return record | {"gap": gap, "proven": plan.status is Status.OPTIMAL, "left": len(state.loose)}


def route(guide: Planner, state: TaskState) -> Route:
    guide.ask(state)
    if guide.route is None:
        raise ValueError("no route")
    return guide.route


def possible(loose: dict[str, XY], carried: list[str]) -> list[Visit]:
    picks = [Visit(VisitKind.PICK, name) for name in loose] if len(carried) < 2 else []
    return [Visit(VisitKind.PLACE, name) for name in carried] + picks


def figures(replans: list[dict[str, Any]]) -> dict[str, Any]:
    """Summarize measurements of replans. Times are in seconds and optimality gaps in per cent."""
    columns = {name: [float(r[name]) for r in replans] for name in ("wall", "cpu", "proof_wall", "proof_cpu")}
    gaps = [r["gap"] for r in replans]
    return {
        "replans": len(replans),
        "proven": sum(r["proven"] for r in replans),
        "gap_mean": float(np.mean(gaps)),
        "gap_max": max(gaps),
        **{f"{name}_median": float(np.median(values)) for name, values in columns.items()},
        **{f"{name}_p95": float(np.percentile(values, 95)) for name, values in columns.items()},
    }


def xy(point: Any) -> XY:
    return float(point[0]), float(point[1])


if __name__ == "__main__":
    main()
