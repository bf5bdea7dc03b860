"""Worked example: how much of people's deviations is the slack of the planner that they are compared with?

    python -m studies.examples.planner_slack --people 4 --out runs/slack

A deviation is a visit other than the suggested one. If the suggestion is not the best, a person who does better
deviates, too. Here the same simulated guests do the same tasks four times, each with another planner: the exact one,
OR-Tools with its usual 200 solutions, OR-Tools in a hurry (10 solutions), and the nearest visit each time. Under `none`
they see no suggestion, and walk the same whatever is planned: only the yardstick differs. Under `optimal` they see it.

Writes slack.csv (a row per condition, number of objects and planner) and slack.png. The trials are a batch: the same
command resumes after an interruption. All of it is simulated: it says what planners do to the measure, and nothing of
what people do.
"""

import argparse
import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from rich.console import Console

from experiments.analysis.comparison_plot import mark_origin
from experiments.record import records
from experiments.record.files import read_arrays
from experiments.record.phases import origin_of
from experiments.record.records import Event, read_events
from experiments.record.run_directory import TRIALS
from experiments.trials.batch import BatchProgress, run_batch
from experiments.trials.design import Design
from experiments.trials.designs import read_study, study_path
from experiments.trials.trial_reader import read_trials
from mjsim.support.files import replacing, write_text_atomically
from planner.ortools_solver import OrToolsSolver
from planner.plan import Plan
from planner.problem import RoutingProblem
from planner.solvers import SolveLimit

HURRIED = "studies.examples.planner_slack:HurriedOrTools"
PLANNERS = {"exact": "exact", "ortools": "OR-Tools", HURRIED: "OR-Tools, hurried", "greedy": "nearest"}
CONDITIONS = ("none", "optimal")
OBJECTS = (6, 12, 18, 24)
FIRST_SEED = 500_000  # apart from other studies
SLACK = 0.01  # m; a suggestion that costs less than that is as good as the best
COLOURS = ("#0072B2", "#E69F00", "#D55E00", "#666666")


@dataclass(frozen=True)
class HurriedOrTools(OrToolsSolver):
    """OR-Tools with 10 solutions instead of 200: what remains of it with little time."""

    name: str = "ortools-hurried"

    def solve(self, problem: RoutingProblem, *, seed: int = 0, limit: SolveLimit | None = None) -> Plan:
        """As OR-Tools, with less work by default."""
        hurried = SolveLimit(work=10) if limit in (None, SolveLimit()) else limit
        return super().solve(problem, seed=seed, limit=hurried)


@dataclass(frozen=True)
class Slack:
    """What one planner makes of the deviations in one cell.

    Attributes:
        origin: Whether people were simulated.
        assistance: Condition.
        objects: Number of objects.
        planner: Who suggested.
        people: How many.
        choices: Visits at which another one was feasible, and of which the regret is known.
        deviations: Share of these that differ from the suggestion.
        better: Share at which the person deviated to a visit that was better than the suggestion, by more than 1 cm.
        suggestion_gap_m: Mean regret of a suggestion, m.
        worse_suggestions: Share of the suggestions that were more than 1 cm worse than the best visit.
        person_regret_m: Mean regret of what people did, m.
    """

    origin: str
    assistance: str
    objects: int
    planner: str
    people: int
    choices: int
    deviations: float
    better: float
    suggestion_gap_m: float
    worse_suggestions: float
    person_regret_m: float


def design(people: int, objects: Sequence[int], first_seed: int = FIRST_SEED) -> Design:
    """The same people with every planner, in their cell; the cheap trials first."""
    cells = [(n, assistance) for n in sorted(objects) for assistance in CONDITIONS]
    typical = read_study(study_path("paper"), 1).trials[0]  # the population of the published design
    return Design(
        tuple(
            msgspec.structs.replace(
                typical,
                objects=n,
                assistance=assistance,
                planner=planner,
                regret=True,
                seed=None,
                person_seed=first_seed + 1000 * k + person,
                order_seed=first_seed + 1000 * k + person,
            )
            for k, (n, assistance) in enumerate(cells)
            for planner in PLANNERS
            for person in range(people)
        )
    )


def slacks(folder: Path) -> list[Slack]:
    """What the trials of a folder say, by condition, number of objects and planner."""
    cells: dict[tuple[str, int, str], list[Sequence[Event]]] = {}
    for trial in read_trials(folder)[0]:
        settings = trial.settings
        key = settings["assistance"], settings["objects"], settings["planner"]
        cells.setdefault(key, []).append(read_events(trial.path / records.EVENTS))
    order = sorted(cells, key=lambda key: (key[0], key[1], list(PLANNERS).index(key[2])))
    return [_slack(*key, cells[key]) for key in order]


def _slack(assistance: str, objects: int, planner: str, logs: Sequence[Sequence[Event]]) -> Slack:
    visits = [
        event for log in logs for event in log if event["event"] == "visit" and event["alternatives"] > 0
    ]
    known = [v for v in visits if v.get("regret_m") is not None and v.get("suggested_regret_m") is not None]
    own, suggested = (np.array([v[name] for v in known]) for name in ("regret_m", "suggested_regret_m"))
    deviated = np.array([v["deviated"] for v in known], bool)
    return Slack(
        origin_of(log[0]["user"] for log in logs),
        assistance,
        objects,
        PLANNERS[planner],
        len(logs),
        len(known),
        float(deviated.mean()),
        float((deviated & (own < suggested - SLACK)).mean()),
        float(suggested.mean()),
        float((suggested > SLACK).mean()),
        float(own.mean()),
    )


def walked_differently(folder: Path) -> Iterator[str]:
    """People who see no suggestion and yet walked otherwise with another planner: there must be none."""
    paths: dict[tuple[int, int], Any] = {}
    for trial in read_trials(folder)[0]:
        if trial.settings["assistance"] == "none":
            key = trial.settings["objects"], trial.settings["person_seed"]
            walked = read_arrays(trial.path / records.TRAJECTORY, only=["position"])["position"]
            if not np.array_equal(paths.setdefault(key, walked), walked):
                yield trial.path.name


def draw(path: Path, found: Sequence[Slack]) -> None:
    """Deviations by number of objects, and how many of them were better than the suggestion (hatched)."""
    figure = Figure(figsize=(9.0, 3.6), layout="constrained")
    FigureCanvasAgg(figure)
    names, levels = list(PLANNERS.values()), sorted({cell.objects for cell in found})
    for axes, assistance in zip(figure.subplots(1, len(CONDITIONS), sharey=True), CONDITIONS, strict=True):
        for cell in (cell for cell in found if cell.assistance == assistance):
            k = names.index(cell.planner)
            place = levels.index(cell.objects) + 0.2 * (k - (len(names) - 1) / 2)
            first = cell.objects == levels[0] and assistance == CONDITIONS[0]
            label = cell.planner if first else None
            axes.bar(place, cell.deviations, 0.18, color=COLOURS[k], label=label)
            axes.bar(place, cell.better, 0.18, color="none", edgecolor="white", hatch="////", lw=0)
        axes.set_xticks(range(len(levels)), [f"{n} objects" for n in levels])
        axes.set_title(f"assistance: {assistance}", fontsize=10)
        axes.spines[["top", "right"]].set_visible(False)
    figure.axes[0].set_ylabel("share of choices that deviate\n(hatched: to a better visit)")
    figure.legend(fontsize=8, frameon=False, ncols=len(names), loc="outside lower center")
    mark_origin(figure, found[0].origin)
    with replacing(path) as temporary:
        figure.savefig(temporary, dpi=120, metadata={"Software": "mjsim"})


def as_csv(found: Sequence[Slack]) -> str:
    """A row per cell and planner."""
    text = io.StringIO()
    writer = csv.DictWriter(text, [field.name for field in fields(Slack)], lineterminator="\n")
    writer.writeheader()
    rows: list[Mapping[str, Any]] = [asdict(cell) for cell in found]
    writer.writerows(rows)
    return text.getvalue()


def main() -> None:
    """Simulate what is missing; then the table and the picture."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--people", type=int, default=4, metavar="N", help="in each cell (default: %(default)s)"
    )
    parser.add_argument("--objects", type=int, nargs="+", default=OBJECTS, metavar="N")
    parser.add_argument("--workers", type=int, default=1, metavar="N")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR")
    arguments = parser.parse_args()
    console = Console(highlight=False, markup=False, soft_wrap=True)

    def show(now: BatchProgress) -> None:
        console.print(f"{now.resumed + now.done} of {now.total} trials, {now.failed} failed", end="\r")

    planned = design(arguments.people, arguments.objects)
    run_batch(planned, arguments.out, workers=arguments.workers, on_progress=show)
    found = slacks(arguments.out)
    write_text_atomically(arguments.out / "slack.csv", as_csv(found))
    draw(arguments.out / "slack.png", found)
    strays = list(walked_differently(arguments.out))
    console.print("\n" + as_csv(found), end="")
    console.print(f"{arguments.out / TRIALS}: {len(strays)} of those without suggestions walked otherwise")


if __name__ == "__main__":
    main()
