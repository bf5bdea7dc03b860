"""Optimal and walked paths of a study: for each condition, the person whose distance is the median."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from experiments.analysis.comparison_plot import mark_origin
from experiments.analysis.page import Picture
from experiments.analysis.report.figures import svg
from experiments.analysis.study.table import StudyTable
from experiments.errors import RecordError
from experiments.house import House
from experiments.record import records
from experiments.record.archive import opened_run, read_file, run_paths
from experiments.record.files import read_arrays
from experiments.record.phases import TASK
from experiments.record.run_directory import TRIALS, is_run
from experiments.trials.floor_plan import PLANNED, WALKED, planned_path
from mjsim.values.episode import Episode

WIDTH = 4.0  # inches of a panel
DISTANCE = "distance"


def paths_figure(table: StudyTable, folder: Path) -> Picture:
    """The figure: a panel per condition, at the smallest number of objects, from the run directories in `folder`."""
    shown = [(row, found) for row in median_people(table) if (found := _run_of(row, folder)) is not None]
    if not shown:
        raise RecordError(f"{folder} holds no run directories of its people")
    figure = Figure(figsize=(WIDTH * len(shown), 0.8 * WIDTH), layout="constrained")
    for axes, (row, run) in zip(figure.subplots(1, len(shown), squeeze=False)[0], shown, strict=True):
        with opened_run(run) as opened:
            _draw_run(axes, row, opened)
    figure.axes[0].legend(fontsize=7, loc="lower left")
    mark_origin(figure, table.origin)
    caption = (
        f"The person with the median distance in each condition, with {table.levels()[0]} objects: the route that was "
        "planned at the start, and the one that was walked, in the house seen from above; metres walked in the titles."
    )
    return svg(figure, f"Planned and walked paths. {table.origin}.", caption)


def median_people(table: StudyTable) -> Iterator[Any]:
    """For each condition, the row of the person with the median distance at the smallest number of objects."""
    if DISTANCE not in table.columns:
        return
    walked, least = table.columns[DISTANCE], table.levels()[0]
    for condition in table.conditions():
        here = np.flatnonzero((table.assistance == condition) & (table.objects == least) & ~np.isnan(walked))
        if len(here):
            yield table.rows[here[np.argsort(walked[here], kind="stable")[(len(here) - 1) // 2]]]


def _run_of(row: Any, folder: Path) -> Path | None:
    """The run directory of a row; fingerprints are of one trial only, but for people who play the same task."""
    visit = folder / str(row.get("participant")) / TASK
    if is_run(visit):
        return visit
    seed = f"{row.get('house_seed')}"
    likely_first = sorted(run_paths(folder / TRIALS), key=lambda path: (seed not in path.name, path))
    for path in likely_first:
        try:
            metrics = json.loads(read_file(path, records.METRICS))
        except (OSError, ValueError, RecordError):
            continue
        if row.get("fingerprint") is not None and metrics.get("fingerprint") == row["fingerprint"]:
            return path
    return None


def _draw_run(axes: Axes, row: Any, run: Path) -> None:
    house = House.load(row["house"])
    episode = Episode.load(run / records.EPISODE)
    plan = next((e for e in records.read_events(run / records.EVENTS) if e["event"] == "plan"), None)
    walked = read_arrays(run / records.TRAJECTORY, only=["position"])["position"]
    for island in house.navmesh.islands:
        for ring in shapely.get_rings(island):
            axes.plot(*shapely.get_coordinates(ring).T, color="#BBBBBB", lw=0.8)
    if plan is not None:
        axes.plot(*planned_path(house, episode, plan).T, "--", color=PLANNED, lw=1.2, label="planned")
    axes.plot(*walked.T, color=WALKED, lw=1.0, label="walked")
    places = np.array([o.position[:2] for o in episode.objects])
    axes.plot(*places.T, "o", color="#0072B2", ms=4, label="objects")
    axes.plot(*walked[0], "*", color="#009E73", ms=9, label="start")
    axes.set(aspect="equal", xticks=[], yticks=[])
    axes.set_title(
        f"{row['assistance']}, {row['objects']} objects: {row['task_distance_m']:.0f} m", fontsize=9
    )
