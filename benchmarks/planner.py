"""Compare planners in disorganized houses by their optimality gaps, computation times and memory.

Each planner solves the same problems in its own process, from the start of a task and from the middle. CPU
time includes only the planner's computation. Gaps are relative to the best tour that any planner found.
"""

import importlib.util
import json
import os
import pickle
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import Progress

from benchmarks._command import load
from experiments.house import House
from planner.problem import RoutingProblem
from planner.route import TaskState
from planner.task_problems import TaskProblems

WORKER = Path(__file__).with_name("_planner_worker.py")
LIVE_WORKER = Path(__file__).with_name("_live_worker.py")
REPORT = load(Path(__file__).with_name("_planner_report.py"))
summary, lines, picture = REPORT.summary, REPORT.lines, REPORT.picture
LIVE_OBJECTS = 24
FIRST_OBJECTS = (12, 24)  # problem sizes for which the first call in a new process is timed
SIZES = (6, 12, 18, 24, 30)
STATES = ("start", "mid-task")
OTHERS_SHARE = 5  # only every fifth house is solved by the other planners, because they are slow
LARGEST_SHARE = 3  # only every third house with 30 objects is used
FIRST_CALL = """
from pathlib import Path
import pickle, sys
problem = pickle.loads(Path(sys.argv[1]).read_bytes())
from planner.solvers import solver
solver("exact").solve(problem)
"""


@dataclass(frozen=True)
class Candidate:
    """A planner with its time limit (0 for its default) and the optional package that it requires."""

    name: str
    seconds: float = 0.0
    module: str | None = None
    start_only: bool = False

    @property
    def label(self) -> str:
        return f"{self.name} {self.seconds:g} s" if self.seconds else self.name

    @property
    def installed(self) -> bool:
        return self.module is None or importlib.util.find_spec(self.module) is not None


CANDIDATES = (
    Candidate("exact"),
    Candidate("ortools", 0.05),
    Candidate("ortools", 0.2),
    Candidate("ortools", 1.0),
    Candidate("ortools", 5.0),
    Candidate("pyvrp", 1.0, "pyvrp", start_only=True),
    Candidate("vroom", 0.0, "vroom", start_only=True),
)


@dataclass(frozen=True, eq=False)
class Case:
    """A routing problem with its number of objects, house seed, and task state."""

    objects: int
    seed: int
    state: str
    problem: RoutingProblem


def measure(*, houses: int = 30, quick: bool = False) -> dict[str, Any]:
    """Run the benchmark and return a JSON-serializable result.

    Args:
        houses: Number of houses for each number of objects.
        quick: True to use only three houses with 6 and 12 objects, and time limits up to 0.2 s.
    """
    sizes = SIZES[:2] if quick else SIZES
    houses = min(houses, 3) if quick else houses
    candidates = [e for e in CANDIDATES if not quick or e.seconds <= 0.2]
    with Progress(console=Console(stderr=True), transient=True) as progress:
        cases = list(make_cases(progress, sizes, houses))
        records: list[dict[str, Any]] = []
        for candidate in candidates:
            if candidate.installed:
                records += solve_all(progress, candidate, chosen(candidate, cases))
    return {
        "benchmark": "planner",
        "cores": os.cpu_count(),
        "houses": houses,
        "not_installed": [e.label for e in candidates if not e.installed],
        "first_call": {
            str(n): first_call(next(c.problem for c in cases if c.objects == n))
            for n in FIRST_OBJECTS
            if n in sizes
        },
        "live": live(sizes[-1] if quick else LIVE_OBJECTS, min(houses, 1 if quick else 12)),
        "summary": summary(records),
        "runs": records,
    }


def make_cases(progress: Progress, sizes: Sequence[int], houses: int) -> Iterator[Case]:
    """Yield problems in disorganized apartments, at the start and at a random later state of each task."""
    house = House.load("apartment")
    problems = TaskProblems(house.geodesics)
    counts = {n: max(1, houses // LARGEST_SHARE) if n == SIZES[-1] else houses for n in sizes}
    bar = progress.add_task("disorganize houses", total=sum(counts.values()))
    for n in sizes:
        for seed in range(counts[n]):
            episode = house.sample_episode(objects=n, seed=seed)
            loose = {o.name: (o.position[0], o.position[1]) for o in episode.objects}
            approach = {key: r.approach for key, r in house.receptacles.items()}
            deliveries = {
                o: (float(approach[r][0]), float(approach[r][1])) for o, r in episode.targets.items()
            }
            begin = TaskState((episode.start.x, episode.start.y), loose, (), deliveries)
            later = mid_task(house, begin, np.random.default_rng([n, seed]))
            for state, task in zip(STATES, (begin, later), strict=True):
                yield Case(n, seed, state, problems.problem(task))
            progress.advance(bar)


def mid_task(house: House, begin: TaskState, rng: np.random.Generator) -> TaskState:
    """Return a random state in which some objects are delivered and up to two are carried."""
    names = [str(name) for name in rng.permutation(list(begin.loose))]
    carried = int(rng.integers(0, 3))
    left = int(rng.integers(1, len(names) - carried + 1))
    at = house.navmesh.sample(rng)
    return TaskState(
        (float(at[0]), float(at[1])),
        {name: begin.loose[name] for name in names[:left]},
        tuple(names[left : left + carried]),
        begin.deliveries,
    )


def chosen(candidate: Candidate, cases: Sequence[Case]) -> list[Case]:
    if candidate.name == "exact":
        return list(cases)
    return [
        c for c in cases if c.seed % OTHERS_SHARE == 0 and (c.state == "start" or not candidate.start_only)
    ]


def solve_all(progress: Progress, candidate: Candidate, cases: Sequence[Case]) -> list[dict[str, Any]]:
    """Solve the cases in a worker process. Return a record for each case."""
    bar = progress.add_task(candidate.label, total=len(cases))
    records = []
    with tempfile.NamedTemporaryFile(suffix=".pickle") as file:
        pickle.dump([c.problem for c in cases], file)
        file.flush()
        command = [sys.executable, "-P", str(WORKER), candidate.name, str(candidate.seconds), file.name]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as worker:
            for case, line in zip(cases, worker.stdout or (), strict=False):
                where = {"planner": candidate.label, "objects": case.objects, "seed": case.seed}
                left = {"state": case.state, "left": len(case.problem.shipments)}
                records.append(where | left | json.loads(line))
                progress.advance(bar)
        if worker.returncode:
            raise subprocess.CalledProcessError(worker.returncode, command)
    return records


def first_call(problem: RoutingProblem) -> dict[str, float]:
    """Measure how long a new process takes to import the planner and solve a problem: the best of three."""
    wall, cpu = [], []
    with tempfile.NamedTemporaryFile(suffix=".pickle") as file:
        pickle.dump(problem, file)
        file.flush()
        for _ in range(3):
            before, spent = time.perf_counter(), children_cpu()
            subprocess.run([sys.executable, "-c", FIRST_CALL, file.name], check=True)
            wall.append(time.perf_counter() - before)
            cpu.append(children_cpu() - spent)
    return {"wall": min(wall), "cpu": min(cpu)}


def live(objects: int, houses: int) -> dict[str, Any]:
    """Measure in a worker process how fast the planner replans for a person who ignores the plan."""
    command = [sys.executable, "-P", str(LIVE_WORKER), str(objects), str(houses)]
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
    found: dict[str, Any] = json.loads(done.stdout)
    return {"objects": objects, "houses": houses, "groups": found}


def children_cpu() -> float:
    times = os.times()
    return times.children_user + times.children_system
