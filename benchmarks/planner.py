"""Compare planners on 500 problems by their optimality gaps, computation times and memory.

Each planner solves the same problems in its own process. CPU time includes only the planner's computation. Gaps are
relative to the best tour that any planner found, which `exact` proves to be optimal for almost all problems. The
planners `search` and `cuts` are the two methods of `exact` for many objects, and `cuts` stops after 60 s.
"""

import importlib.util
import json
import os
import pickle
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import Progress

from benchmarks._command import load
from benchmarks.support.planner_cases import COUNTS, Case, make_cases
from experiments.errors import ConfigError
from planner.problem import RoutingProblem

WORKER = Path(__file__).with_name("_planner_worker.py")
LIMITS_WORKER = Path(__file__).with_name("_limits_worker.py")
LIVE_WORKER = Path(__file__).with_name("_live_worker.py")
REPORT = load(Path(__file__).with_name("_planner_report.py"))
summary, lines, picture = REPORT.summary, REPORT.lines, REPORT.picture
LIVE_OBJECTS = 24
FIRST_OBJECTS = (12, 24)  # problem sizes for which the first call in a new process is timed
OTHERS_SHARE = 5  # only every fifth problem is solved by the other planners, because they are slow
PARTS = ("instances", "limits", "live", "first")
LIMITED_SOLVES = 1_000  # number of solves with a time limit
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
    most: int = 60  # maximum number of objects

    @property
    def label(self) -> str:
        return f"{self.name} {self.seconds:g} s" if self.seconds else self.name

    @property
    def installed(self) -> bool:
        return self.module is None or importlib.util.find_spec(self.module) is not None


CANDIDATES = (
    Candidate("exact"),
    Candidate("search", most=30),
    Candidate("cuts", 60.0),  # with many bins, some problems would take a quarter of an hour
    Candidate("ortools", 0.05),
    Candidate("ortools", 0.2),
    Candidate("ortools", 1.0),
    Candidate("ortools", 5.0),
    Candidate("pyvrp", 1.0, "pyvrp"),
    Candidate("vroom", 0.0, "vroom"),
)


def measure(
    *, houses: int = 30, count: int = LIMITED_SOLVES, parts: Sequence[str] = PARTS, quick: bool = False
) -> dict[str, Any]:
    """Run the benchmark and return a JSON-serializable result.

    Args:
        houses: Maximum number of problems of each kind and size.
        count: Number of solves with a time limit.
        parts: Parts to run: planners on all problems (instances), time limits (limits), replanning in real time
            (live) and the first plan of a new process (first).
        quick: True to use at most three problems with 6 and 12 objects, time limits up to 0.2 s, and 20 solves.
    """
    if unknown := sorted(set(parts) - set(PARTS)):
        raise ConfigError(f"unknown parts {unknown}; choose from {list(PARTS)}")
    houses, count = (min(houses, 3), min(count, 20)) if quick else (houses, count)
    sizes = {n for sizes in COUNTS.values() for n in sizes if n <= 12 or not quick}
    counts = {kind: {n: min(k, houses) for n, k in of.items() if n in sizes} for kind, of in COUNTS.items()}
    candidates = [e for e in CANDIDATES if not quick or e.name == "cuts" or e.seconds <= 0.2]
    result: dict[str, Any] = {"benchmark": "planner", "cores": os.cpu_count(), "houses": houses}
    if "instances" in parts:
        result |= instances(candidates, counts)
    if "limits" in parts:
        result["limits"] = from_worker(LIMITS_WORKER, count)
    if "live" in parts:
        objects, tasks = (max(sizes), 1) if quick else (LIVE_OBJECTS, min(houses, 12))
        groups = from_worker(LIVE_WORKER, objects, tasks)
        result["live"] = {"objects": objects, "houses": tasks, "groups": groups}
    if "first" in parts:
        cases = make_cases({"apartment": {n: 1 for n in FIRST_OBJECTS if n in sizes}})
        result["first_call"] = {str(case.objects): first_call(case.problem) for case in cases}
    return result


def instances(candidates: Sequence[Candidate], counts: Mapping[str, Mapping[int, int]]) -> dict[str, Any]:
    with Progress(console=Console(stderr=True), transient=True) as progress:
        bar = progress.add_task("make problems", total=sum(sum(of.values()) for of in counts.values()))
        cases = []
        for case in make_cases(counts):
            cases.append(case)
            progress.advance(bar)
        records: list[dict[str, Any]] = []
        for candidate in candidates:
            if candidate.installed:
                records += solve_all(progress, candidate, chosen(candidate, cases))
    missing = [e.label for e in candidates if not e.installed]
    return {"not_installed": missing, "summary": summary(records), "runs": records}


def chosen(candidate: Candidate, cases: Sequence[Case]) -> list[Case]:
    if candidate.name == "exact":
        return list(cases)
    able = [c for c in cases if c.objects <= candidate.most and not (candidate.module and c.problem.onboard)]
    return [c for c in able if c.seed % OTHERS_SHARE == 0]


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
                left = {"kind": case.kind, "left": len(case.problem.shipments)}
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


def from_worker(script: Path, *arguments: int) -> dict[str, Any]:
    """Return the JSON object that a worker process prints."""
    command = [sys.executable, "-P", str(script), *map(str, arguments)]
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def children_cpu() -> float:
    times = os.times()
    return times.children_user + times.children_system
