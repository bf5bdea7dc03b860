"""Planners on disorganized houses, from the start and mid-task: gaps, times, proofs, memory.

Each planner solves the same problems in a process of its own. CPU seconds count what a planner computed; wall time is
shared with whatever else runs. Gaps are to the best tour that
any planner found: the optimum where one is proven.
"""

import importlib.util
import io
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
from rich.table import Table

from experiments.house import House
from planner.problem import RoutingProblem
from planner.replanner import Replanner
from planner.route import TaskState
from planner.solver import solver

WORKER = Path(__file__).with_name("_planner_worker.py")
LIVE_WORKER = Path(__file__).with_name("_live_worker.py")
LIVE_OBJECTS = 24
SIZES = (6, 12, 18, 24, 30)
STATES = ("start", "mid-task")
OTHERS_SHARE = 5  # every fifth house is also solved by the others, which take seconds by their nature
LARGEST_SHARE = 3  # every third house with 30 objects
FIRST_CALL = """
from pathlib import Path
import pickle, sys
problem = pickle.loads(Path(sys.argv[1]).read_bytes())
from planner.solver import solver
solver("exact").solve(problem)
"""


@dataclass(frozen=True)
class Entrant:
    """A planner with a limit of seconds (0: its own budget); `module` is the optional package that it needs."""

    name: str
    seconds: float = 0.0
    module: str | None = None
    start_only: bool = False

    @property
    def label(self) -> str:
        """Name in tables."""
        return f"{self.name} {self.seconds:g} s" if self.seconds else self.name

    @property
    def installed(self) -> bool:
        """Whether its package is."""
        return self.module is None or importlib.util.find_spec(self.module) is not None


ENTRANTS = (
    Entrant("exact"),
    Entrant("ortools", 0.05),
    Entrant("ortools", 0.2),
    Entrant("ortools", 1.0),
    Entrant("ortools", 5.0),
    Entrant("pyvrp", 1.0, "pyvrp", start_only=True),
    Entrant("vroom", 0.0, "vroom", start_only=True),
)


@dataclass(frozen=True, eq=False)
class Case:
    """A problem: how many objects the house has, its seed, and the state of the task."""

    objects: int
    seed: int
    state: str
    problem: RoutingProblem


def measure(*, houses: int = 30, quick: bool = False) -> dict[str, Any]:
    """Run the benchmark; everything in it can be written as JSON.

    Args:
        houses: Houses of each size.
        quick: Three houses of 6 and 12 objects, and no limit above 0.2 s.
    """
    sizes = SIZES[:2] if quick else SIZES
    houses = min(houses, 3) if quick else houses
    entrants = [e for e in ENTRANTS if not quick or e.seconds <= 0.2]
    with Progress(console=Console(stderr=True), transient=True) as progress:
        cases = list(make_cases(progress, sizes, houses))
        records: list[dict[str, Any]] = []
        for entrant in entrants:
            if entrant.installed:
                records += solve_all(progress, entrant, chosen(entrant, cases))
    return {
        "benchmark": "planner",
        "cores": os.cpu_count(),
        "houses": houses,
        "not_installed": [e.label for e in entrants if not e.installed],
        "first_call": first_call(cases[0].problem),
        "live": live(sizes[-1] if quick else LIVE_OBJECTS, min(houses, 1 if quick else 12)),
        "summary": summary(records),
        "runs": records,
    }


def make_cases(progress: Progress, sizes: Sequence[int], houses: int) -> Iterator[Case]:
    """Problems of disorganized apartments, each from the start and from a random feasible state of the same task."""
    house = House.load("apartment")
    replanner = Replanner(house.geodesics, solver("exact"))
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
                yield Case(n, seed, state, replanner.problem(task))
            progress.advance(bar)


def mid_task(house: House, begin: TaskState, rng: np.random.Generator) -> TaskState:
    """A state with some objects delivered, none to two carried, and the person anywhere on the floor."""
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


def chosen(entrant: Entrant, cases: Sequence[Case]) -> list[Case]:
    """The cases that a planner gets."""
    if entrant.name == "exact":
        return list(cases)
    return [c for c in cases if c.seed % OTHERS_SHARE == 0 and (c.state == "start" or not entrant.start_only)]


def solve_all(progress: Progress, entrant: Entrant, cases: Sequence[Case]) -> list[dict[str, Any]]:
    """One record per case, from a process of its own."""
    bar = progress.add_task(entrant.label, total=len(cases))
    records = []
    with tempfile.NamedTemporaryFile(suffix=".pickle") as file:
        pickle.dump([c.problem for c in cases], file)
        file.flush()
        command = [sys.executable, "-P", str(WORKER), entrant.name, str(entrant.seconds), file.name]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as worker:
            for case, line in zip(cases, worker.stdout or (), strict=False):
                where = {"planner": entrant.label, "objects": case.objects, "seed": case.seed}
                left = {"state": case.state, "left": len(case.problem.shipments)}
                records.append(where | left | json.loads(line))
                progress.advance(bar)
        if worker.returncode:
            raise subprocess.CalledProcessError(worker.returncode, command)
    return records


def first_call(problem: RoutingProblem) -> dict[str, float]:
    """Seconds of a fresh process that imports the planner and solves one problem; the best of three."""
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
    """Replans beside a person who goes their own way: see the worker."""
    command = [sys.executable, "-P", str(LIVE_WORKER), str(objects), str(houses)]
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
    found: dict[str, Any] = json.loads(done.stdout)
    return {"objects": objects, "houses": houses, "groups": found}


def children_cpu() -> float:
    """CPU seconds of all processes that were started here and have ended."""
    times = os.times()
    return times.children_user + times.children_system


def summary(records: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """One row per planner, size and state; gaps of the problems that it found a tour for."""
    best: dict[tuple[int, int, str], float] = {}
    groups: dict[tuple[int, str, str], list[dict[str, Any]]] = {}
    for r in records:
        if r["cost"] is not None:
            key = r["objects"], r["seed"], r["state"]
            best[key] = min(best.get(key, r["cost"]), r["cost"])
        groups.setdefault((r["objects"], r["state"], r["planner"]), []).append(r)
    ranked = sorted(groups.items(), key=lambda item: (item[0][0], item[0][1] != "start"))
    return [
        {"objects": n, "state": state, "planner": planner, **figures(group, best)}
        for (n, state, planner), group in ranked
    ]


def figures(group: Sequence[dict[str, Any]], best: dict[tuple[int, int, str], float]) -> dict[str, Any]:
    """What one planner did with the problems of one size and state; None where there is nothing to say."""
    solved = [r for r in group if r["cost"] is not None]
    gaps = [100 * (r["cost"] / best[r["objects"], r["seed"], r["state"]] - 1) for r in solved]
    # An empty tour of length 0 is optimal: nothing is left to do there.
    bounds = [100 * (r["cost"] - r["bound"]) / (r["cost"] or 1.0) for r in solved if r["bound"] is not None]
    cpu, wall = [r["cpu"] for r in group], [r["wall"] for r in group]
    return {
        "problems": len(group),
        "solved": len(solved),
        "proven": sum(r["proven"] for r in group),
        "best": sum(gap < 0.001 for gap in gaps),
        "gap_mean": float(np.mean(gaps)) if gaps else None,
        "gap_max": max(gaps, default=None),
        "bound_gap_max": max(bounds, default=None),
        "cpu_median": float(np.median(cpu)),
        "cpu_p95": float(np.percentile(cpu, 95)),
        "cpu_max": max(cpu),
        "wall_median": float(np.median(wall)),
        "wall_p95": float(np.percentile(wall, 95)),
        "peak_mb": max(r["peak_mb"] for r in group),
    }


def lines(result: dict[str, Any]) -> Iterator[str]:
    """The result for people."""
    table = Table(title=f"{result['houses']} disorganized apartments; gaps in %, times in s")
    for heading in ("n", "state", "planner"):
        table.add_column(heading)
    for heading in (
        "problems",
        "proven",
        "best",
        "gap",
        "max gap",
        "CPU median",
        "p95",
        "max",
        "wall",
        "p95",
        "MB",
    ):
        table.add_column(heading, justify="right")
    previous = None
    for row in result["summary"]:
        group = row["objects"], row["state"]
        if previous not in (None, group):
            table.add_section()
        first = ("", "") if group == previous else (str(row["objects"]), row["state"])
        previous = group
        table.add_row(*first, row["planner"], *cells(row))
    text = io.StringIO()
    Console(file=text, width=140).print(table)
    yield from text.getvalue().splitlines()
    for label in result["not_installed"]:
        yield f"{label}: not installed (pip install 'mjsim[peers]')"
    yield (
        "gap: to the best tour found; best: how often it was; unproven: greatest gap to the planner's own bound"
    )
    beside = result["live"]
    yield f"live, {beside['objects']} objects, {beside['houses']} houses, every visit drawn at random:"
    for name, row in beside["groups"].items():
        yield (
            f"  {name}: {row['replans']} replans; first plan {1000 * row['wall_median']:.0f} ms, "
            f"95 % within {1000 * row['wall_p95']:.0f} ms (CPU {1000 * row['cpu_median']:.0f}, "
            f"{1000 * row['cpu_p95']:.0f} ms), gap {row['gap_mean']:.2f} %, at most {row['gap_max']:.1f} %; "
            f"{row['proven']} proven, after {row['proof_wall_median']:.2f} s, 95 % within {row['proof_wall_p95']:.2f} s"
        )
    first = result["first_call"]
    yield f"first answer in a fresh process: {first['wall']:.2f} s, CPU {first['cpu']:.2f} s"


def cells(row: dict[str, Any]) -> list[str]:
    """Figures of a row of the table."""
    failed = row["problems"] - row["solved"]
    counts = [
        f"{row['problems']}" + (f", {failed} failed" if failed else ""),
        str(row["proven"]),
        str(row["best"]),
    ]
    gaps = [
        "none" if row[name] is None else f"{row[name]:.2f}"
        for name in ("gap_mean", "gap_max", "bound_gap_max")
    ]
    names = ("cpu_median", "cpu_p95", "cpu_max", "wall_median", "wall_p95")
    return counts + gaps + [f"{row[name]:.2f}" for name in names] + [f"{row['peak_mb']:.0f}"]


def picture(result: dict[str, Any], path: Path) -> None:
    """Left, mean gap over CPU time with 24 objects (or the most there are); right, CPU time to proof by size."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 4), layout="constrained")
    left, right = figure.subplots(1, 2)
    sizes = sorted({row["objects"] for row in result["summary"]})
    shown = max(n for n in sizes if n <= 24)
    for row in result["summary"]:
        if row["objects"] == shown and row["state"] == "start" and row["gap_mean"] is not None:
            left.plot(row["cpu_median"], row["gap_mean"], "o", label=row["planner"])
            left.annotate(
                row["planner"],
                (row["cpu_median"], row["gap_mean"]),
                xytext=(5, 5),
                textcoords="offset points",
            )
    left.set(
        xscale="log",
        xlabel="CPU time, s (median)",
        ylabel="mean gap, %",
        title=f"{shown} objects, from the start",
    )
    left.margins(x=0.3, y=0.15)
    exact = [r for r in result["runs"] if r["planner"] == "exact"]
    for k, state in enumerate(STATES):
        of_state = [[r for r in exact if (r["objects"], r["state"]) == (n, state)] for n in sizes]
        colour = f"C{k}"
        for x, runs in enumerate(of_state):
            spread = np.linspace(-0.12, 0.12, len(runs)) + 0.36 * k - 0.18
            for done, marker in ((True, "o"), (False, "x")):
                points = [
                    (x + dx, r["cpu"]) for dx, r in zip(spread, runs, strict=True) if r["proven"] == done
                ]
                if points:
                    right.plot(*np.array(points).T, marker, color=colour, markersize=4, alpha=0.7)
        right.plot([], [], "o", color=colour, label=state)
    right.plot([], [], "x", color="grey", label="budget spent, not proven")
    right.set(yscale="log", xlabel="objects", ylabel="CPU time, s", title="exact: time to proof")
    right.set_xticks(range(len(sizes)), [str(n) for n in sizes])
    right.legend(loc="upper left")
    for axes in (left, right):
        axes.grid(alpha=0.3)
    figure.savefig(path, dpi=110)
