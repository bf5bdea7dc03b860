"""Worked example: measure how many of the participants' deviations are caused by an imperfect planner.

    python -m studies.examples.planner_slack --people 4 --out runs/slack

A deviation is a visit that differs from the planner's suggestion. If the suggestion is not optimal, better
choices count as deviations, too. In this example, the same simulated guests do the same tasks with four
planners: the exact one, OR-Tools with 200 solutions (the default), OR-Tools with 10 solutions, and one that
always chooses the nearest visit. Under `none`, guests see no suggestion and walk the same way with every
planner. Under `optimal`, they see it.

The example writes slack.csv (a row for each condition, number of objects and planner) and slack.png. If it is
interrupted, the same command resumes it. All data are simulated: they show the effect of planners on the
measure, not the behaviour of people.
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
from experiments.trials.trial_reader import TrialReader
from mjsim.support.files import replacing, write_text_atomically
from planner.ortools_solver import OrToolsSolver
from planner.plan import Plan
from planner.problem import RoutingProblem
from planner.solvers import SolveLimit

HURRIED = "studies.examples.planner_slack:HurriedOrTools"
PLANNERS = {"exact": "exact", "ortools": "OR-Tools", HURRIED: "OR-Tools, hurried", "greedy": "nearest"}
CONDITIONS = ("none", "optimal")
OBJECTS = (6, 12, 18, 24)
FIRST_SEED = 500_000  # first seed of the participants, different from those of other studies
SLACK = 0.01  # tolerance for the cost of a suggestion that counts as optimal, in metres
COLOURS = ("#0072B2", "#E69F00", "#D55E00", "#666666")


@dataclass(frozen=True)
class HurriedOrTools(OrToolsSolver):
    """OR-Tools with 10 solutions instead of 200, as a planner that has little time."""

    name: str = "ortools-hurried"

    def solve(self, problem: RoutingProblem, *, seed: int = 0, limit: SolveLimit | None = None) -> Plan:
        """Solve the problem like OR-Tools, with a smaller default limit."""
        hurried = SolveLimit(work=10) if limit in (None, SolveLimit()) else limit
        return super().solve(problem, seed=seed, limit=hurried)


@dataclass(frozen=True)
class Slack:
    """Deviations from the suggestions of one planner in one cell.

    Attributes:
        origin: Label that tells whether participants were simulated.
        assistance: Name of the condition.
        objects: Number of objects.
        planner: Name of the planner.
        people: Number of participants.
        choices: Number of visits that have a known regret and at least one alternative.
        deviations: Share of these visits that differ from the suggestion.
        better: Share of these visits that differ from the suggestion and are more than 1 cm better.
        suggestion_gap_m: Mean regret of the suggestions, m.
        worse_suggestions: Share of the suggestions that are more than 1 cm worse than the best visit.
        person_regret_m: Mean regret of the participants' visits, m.
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
    """Return a design in which the same participants work with every planner. Small trials come first."""
    cells = [(n, assistance) for n in sorted(objects) for assistance in CONDITIONS]
    typical = read_study(study_path("paper"), 1).trials[0]  # has the participants of the published study
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
    """Summarize the trials in a folder by condition, number of objects and planner."""
    cells: dict[tuple[str, int, str], list[Sequence[Event]]] = {}
    for trial in TrialReader(folder).read()[0]:
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
    """Yield trials without suggestions whose path depends on the planner. No such trial should exist."""
    paths: dict[tuple[int, int], Any] = {}
    for trial in TrialReader(folder).read()[0]:
        if trial.settings["assistance"] == "none":
            key = trial.settings["objects"], trial.settings["person_seed"]
            walked = read_arrays(trial.path / records.TRAJECTORY, only=["position"])["position"]
            if not np.array_equal(paths.setdefault(key, walked), walked):
                yield trial.path.name


def draw(path: Path, found: Sequence[Slack]) -> None:
    """Draw the share of deviations by number of objects. Deviations to a better visit are hatched."""
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
    """Format the results as CSV, with a row for each cell and planner."""
    text = io.StringIO()
    writer = csv.DictWriter(text, [field.name for field in fields(Slack)], lineterminator="\n")
    writer.writeheader()
    rows: list[Mapping[str, Any]] = [asdict(cell) for cell in found]
    writer.writerows(rows)
    return text.getvalue()


def main() -> None:
    """Run the missing trials, then write the table and the figure."""
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
