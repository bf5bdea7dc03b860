"""Check whether a study's statistical tests give the same results at fidelity `event` as at `full`.

Both fidelities simulate the same participants. Orders of means are also compared, although means that are
close together may change their order by chance.
"""

import os
import tempfile
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from experiments.analysis.statistics.effects import ALPHA
from experiments.analysis.study.measures import read_measures
from experiments.analysis.study.table import StudyTable, read_study
from experiments.errors import StatisticsError
from experiments.trials import designs as study
from experiments.trials.batch import run_batch
from experiments.trials.design import Design
from experiments.trials.trial_config import TrialConfig
from studies.published import Published, read_published
from studies.score_rules import points, published_cells, tests_of

PEOPLE = 40  # number of participants per cell
QUICK_PEOPLE = 2
QUICK_OBJECTS = (6,)
TIERS = ("full", "event")
INFERENCE, ORDER = "inferences", "orders of means"


def measure(
    *, count: int = 0, objects: Sequence[int] = (), workers: int = 0, quick: bool = False
) -> dict[str, Any]:
    """Run the benchmark and return a JSON-serializable result.

    Args:
        count: Largest number of participants per cell (default: 40, or 2 if `quick`).
        objects: Numbers of objects (default: all, or 6 if `quick`).
        workers: Number of processes (default: one per core).
        quick: True to simulate only a few participants.
    """
    levels = tuple(objects) or (QUICK_OBJECTS if quick else (6, 12, 18, 24))
    chosen = people(count or (QUICK_PEOPLE if quick else PEOPLE), levels)
    tables = {tier: _simulated(chosen, tier, workers or os.cpu_count() or 1) for tier in TIERS}
    published = read_published()
    rows = [
        {"what": what, "kind": kind, **{tier: found[tier] for tier in TIERS}}
        for (kind, what), found in _decisions(tables, published).items()
    ]
    return {"people": len(chosen), "objects": list(levels), "decisions": rows, "same_person": _gaps(tables)}


def people(count: int, objects: Sequence[int]) -> list[TrialConfig]:
    """Return the first `count` participants of each published cell with one of these numbers of objects."""
    taken: Counter[Any] = Counter()
    chosen = []
    for trial in study.read_study(study.study_path("paper")).trials:
        cell = trial.assistance, trial.objects
        if trial.objects in objects and taken[cell] < count:
            taken[cell] += 1
            chosen.append(trial)
    return chosen


def _simulated(trials: Sequence[TrialConfig], tier: str, workers: int) -> StudyTable:
    design = Design(tuple(msgspec.structs.replace(trial, fidelity=tier) for trial in trials))
    with tempfile.TemporaryDirectory() as folder:
        run_batch(design, Path(folder) / tier, workers=workers)
        return published_cells(read_study(Path(folder) / tier, read_measures()), read_published())


def _decisions(tables: dict[str, StudyTable], published: Published) -> dict[tuple[str, str], dict[str, str]]:
    """Return the results of all tests at each fidelity. Tests that cannot be computed are left out."""
    found: dict[tuple[str, str], dict[str, str]] = {}
    for tier, table in tables.items():
        for test in published.tests:
            where = f"{test.objects} objects" if test.objects else "all objects"
            try:
                one = tests_of(table, test.measure, test.objects)[test.effect]
            except StatisticsError:
                continue
            words = f"{'p < .05' if one.p < ALPHA else 'n.s.'} (F = {one.statistic:.2f})"
            found.setdefault((INFERENCE, f"{test.measure}: {test.effect}, {where}"), {})[tier] = words
        for direction in published.directions:
            try:
                holds = points(table, direction)
            except StatisticsError:
                continue
            what = ORDER, f"{direction.measure}: {direction.label()}"
            found.setdefault(what, {})[tier] = "yes" if holds else "no"
    return {what: tiers for what, tiers in found.items() if len(tiers) == len(TIERS)}


def _gaps(tables: dict[str, StudyTable]) -> dict[str, dict[str, float]]:
    """Compare each participant's measures between fidelities, in standard deviations of `full`."""
    full, event = (tables[tier] for tier in TIERS)
    there = {_person(row): k for k, row in enumerate(full.rows)}
    order = [there[_person(row)] for row in event.rows]
    gaps = {}
    for name in read_measures().objective:
        if name in full.columns:
            difference = (event.columns[name] - full.columns[name][order]) / full.columns[name].std(ddof=1)
            gaps[name] = {"mean": float(np.mean(difference)), "largest": float(np.abs(difference).max())}
    return gaps


def _person(row: Any) -> tuple[Any, ...]:
    return row["assistance"], row["objects"], row["person_seed"]


def same(row: dict[str, str]) -> bool:
    return row["full"].split(" (")[0] == row["event"].split(" (")[0]


def lines(result: dict[str, Any]) -> Iterator[str]:
    yield f"{result['people']} simulated people in each tier"
    yield ""
    yield "| what is decided | full | event | same |"
    yield "|---|---|---|---|"
    for row in result["decisions"]:
        yield f"| {row['what']} | {row['full']} | {row['event']} | {'yes' if same(row) else 'NO'} |"
    yield ""
    for name, gap in result["same_person"].items():
        yield (
            f"{name}: event - full is {gap['mean']:+.3f} standard deviations on average, {gap['largest']:.3f} at most"
        )
    for kind in (INFERENCE, ORDER):
        rows = [row for row in result["decisions"] if row["kind"] == kind]
        agree = sum(map(same, rows))
        verdict = "" if kind == ORDER else f" ({'pass' if agree == len(rows) else 'FAIL'})"
        yield f"{kind} that agree: {agree} of {len(rows)}{verdict}"
