"""Draw the figures of a study report as inline SVG. The same data always give the same SVG code."""

import io
import json
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import shapely
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from numpy.typing import NDArray

from experiments.analysis.comparison import mean_interval
from experiments.analysis.comparison_plot import mark_origin
from experiments.analysis.page import FigureBlock
from experiments.analysis.study.analysis import Analysis
from experiments.analysis.study.measures import LIKERT_PREFIX
from experiments.analysis.study.table import StudyTable
from experiments.errors import RecordError
from experiments.house import House
from experiments.record import records
from experiments.record.archive import opened_run, read_file, run_paths
from experiments.record.files import read_arrays
from experiments.record.phases import TASK
from experiments.record.run_directory import TRIALS, is_run
from experiments.trials.design import counted
from experiments.trials.floor_plan import PLANNED, WALKED, planned_path
from mjsim.values.episode import Episode

# The Okabe-Ito palette, whose colours can be distinguished with common forms of colour blindness
COLOURS = ("#666666", "#E69F00", "#0072B2", "#009E73", "#CC79A7", "#56B4E9")
MARKERS = ("o", "s", "^", "D", "v", "P")
ANSWER_COLOURS = ("#B35806", "#F1A340", "#D8DAEB", "#998EC3", "#542788")
RASTER_DPI = 200  # resolution at which dots are rasterized
PANEL = (3.0, 2.6)  # size of a panel, in inches
JITTER = 0.12  # maximum horizontal shift of a dot, as a fraction of a category's width
MAX_DOTS = 2000  # number of dots above which all dots are rasterized to limit the file size
WIDTH = 4.0  # width of a panel with a walked path, in inches
DISTANCE = "distance"


def by_condition(table: StudyTable, labels: Mapping[str, str]) -> FigureBlock:
    """Plot each participant as a dot, and the mean of each condition with a 95 % confidence interval."""
    levels = table.levels()
    figure = Figure(figsize=(PANEL[0] * len(levels), PANEL[1] * len(labels)), layout="constrained")
    for panels, name in zip(grid(figure, len(labels), len(levels)), labels, strict=True):
        for axes, objects in zip(panels, levels, strict=True):
            _draw_people(axes, table, name, objects)
            axes.set_ylim(*_limits(table, name))
        panels[0].set_ylabel(labels[name], fontsize=8)
    for axes, objects in zip(figure.axes, levels, strict=False):
        axes.set_title(counted(objects, "object"), fontsize=9)
    caption = "Each dot is a person; black: means with 95 % confidence intervals (Student's t)."
    return framed(figure, "Measures by condition and number of objects", table.origin, caption)


def _draw_people(axes: Axes, table: StudyTable, name: str, objects: int) -> None:
    groups = table.groups(name, objects)
    for place, (condition, values) in enumerate(groups.items()):
        # Use a deterministic jitter so that the same data always give the same figure.
        shift = JITTER * np.sin(np.arange(len(values)) * 2.4)
        dots = axes.plot(place + shift, values, ".", color=_colour(table, condition), ms=3, alpha=0.5)
        dots[0].set_rasterized(len(values) > MAX_DOTS)
        low, high = mean_interval(values) or (values.mean(), values.mean())
        error = [[values.mean() - low], [high - values.mean()]]
        axes.errorbar(place + 0.28, values.mean(), error, fmt="o", color="black", capsize=3, ms=5)
    axes.set_xticks(range(len(groups)), list(groups))


def interactions(table: StudyTable, labels: Mapping[str, str]) -> FigureBlock:
    """Plot the condition means of each measure, with 95 % intervals, against the number of objects."""
    figure = Figure(figsize=(PANEL[0] * len(labels), PANEL[1] + 0.3), layout="constrained")
    for axes, name in zip(grid(figure, 1, len(labels))[0], labels, strict=True):
        for k, condition in enumerate(table.conditions()):
            _draw_line(axes, table, name, condition, shift=0.25 * (k - (len(table.conditions()) - 1) / 2))
        axes.set_xticks(table.levels())
        axes.set_xlabel("objects", fontsize=8)
        axes.set_ylabel(labels[name], fontsize=8)
        axes.set_ylim(*_limits(table, name))
    figure.axes[0].legend(fontsize=7, frameon=False)
    caption = (
        "Means by number of objects with 95 % confidence intervals, side by side. Each measure has the axis "
        "of the figure above."
    )
    return framed(figure, "Means by number of objects and condition", table.origin, caption)


def variances(table: StudyTable, name: str, label: str) -> FigureBlock:
    """Draw histograms of a measure for each condition (rows) and number of objects (columns)."""
    levels, conditions = table.levels(), table.conditions()
    figure = Figure(figsize=(2.2 * len(levels), 1.3 * len(conditions) + 0.5), layout="constrained")
    panels = figure.subplots(len(conditions), len(levels), squeeze=False, sharex=True, sharey=True)
    values = table.columns[name][~np.isnan(table.columns[name])]
    edges = np.linspace(values.min(), values.max() if np.ptp(values) else values.min() + 1.0, 16)
    for row, condition in zip(panels, conditions, strict=True):
        for axes, objects in zip(row, levels, strict=True):
            found = table.groups(name, objects).get(condition)
            if found is not None:
                axes.hist(found, edges, color=_colour(table, condition))
            axes.tick_params(labelsize=7)
        row[0].set_ylabel(f"{condition}\n(people)", fontsize=8)
    for axes, objects in zip(panels[0], levels, strict=True):
        axes.set_title(counted(objects, "object"), fontsize=8)
    figure.supxlabel(label, fontsize=9)
    caption = "Number of people by value, in each cell."
    return framed(figure, f"Distribution of {label.lower()}", table.origin, caption)


def answers(analysis: Analysis) -> FigureBlock:
    """Draw stacked bars of the answers to each survey item, with one bar per condition."""
    table = analysis.table
    items = [name for name in table.columns if name.startswith(LIKERT_PREFIX)]
    points = analysis.measures.points
    colours = LinearSegmentedColormap.from_list("answers", ANSWER_COLOURS, points)
    figure = Figure(figsize=(7.0, 0.9 * len(items) + 0.6), layout="constrained")
    for axes, item in zip(grid(figure, len(items), 1)[:, 0], items, strict=True):
        groups = table.groups(item)
        for place, values in enumerate(groups.values()):
            left = 0.0
            for answer in range(1, points + 1):
                share = float((values == answer).mean())
                axes.barh(-place, share, left=left, color=colours(answer - 1), height=0.8)
                left += share
        axes.set_yticks([-k for k in range(len(groups))], list(groups))
        axes.set_title(analysis.measures.likert[item.removeprefix(LIKERT_PREFIX)], fontsize=9, loc="left")
        axes.set_xlim(0, 1)
    figure.supxlabel("share of people", fontsize=9)
    shares = f"Shares of the answers from 1 (brown, disagree) to {points} (violet, agree)"
    caption = f"{shares}, all numbers of objects together."
    return framed(figure, "Answers by condition", table.origin, caption)


def framed(figure: Figure, title: str, origin: str, caption: str) -> FigureBlock:
    """Label a figure with the origin of its data, and convert it to inline SVG."""
    mark_origin(figure, origin)
    FigureCanvasSVG(figure)
    text = io.StringIO()
    with matplotlib.rc_context({"svg.hashsalt": "mjsim", "svg.fonttype": "path"}):
        figure.savefig(text, format="svg", dpi=RASTER_DPI, metadata={"Date": None})
    found = re.sub(r"<metadata>.*?</metadata>", "", text.getvalue(), flags=re.DOTALL)
    found = found[found.index("<svg") :]
    found = re.sub(r'\sxmlns(:\w+)?="[^"]*"', "", found)
    found = found.replace("<svg", f'<svg role="img" aria-label="{title}. {origin}."', 1)
    drawing = Markup(found)  # nosec B704  # titles and drawings of this package
    return FigureBlock(drawing, caption)


def grid(figure: Figure, rows: int, columns: int) -> NDArray[Any]:
    panels: NDArray[Any] = figure.subplots(rows, columns, squeeze=False)
    for axes in panels.ravel():
        axes.tick_params(labelsize=7)
        axes.spines[["top", "right"]].set_visible(False)
    return panels


def _limits(table: StudyTable, name: str) -> tuple[float, float]:
    values = table.columns[name]
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    margin = 0.04 * (high - low) or 0.5
    return low - margin, high + margin


def _colour(table: StudyTable, condition: str) -> str:
    return COLOURS[table.conditions().index(condition) % len(COLOURS)]


def _draw_line(axes: Axes, table: StudyTable, name: str, condition: str, shift: float) -> None:
    found = [(n, table.groups(name, n).get(condition)) for n in table.levels()]
    known = [(n, v) for n, v in found if v is not None]
    if not known:
        return
    means = np.array([v.mean() for _, v in known])
    bounds = np.array([mean_interval(v) or (v.mean(), v.mean()) for _, v in known])
    axes.errorbar(
        [n + shift for n, _ in known],
        means,
        [means - bounds[:, 0], bounds[:, 1] - means],
        color=_colour(table, condition),
        marker=MARKERS[table.conditions().index(condition) % len(MARKERS)],
        ms=4,
        lw=1.3,
        capsize=2,
        label=condition,
    )


def paths_figure(table: StudyTable, folder: Path) -> FigureBlock:
    """Draw the planned and walked paths of one participant per condition. `folder` contains the runs.

    Raises:
        RecordError: `folder` does not contain the runs of these participants.
    """
    shown = [(row, found) for row in median_people(table) if (found := _run_of(row, folder)) is not None]
    if not shown:
        raise RecordError(f"{folder} has no run directories of its people")
    figure = Figure(figsize=(WIDTH * len(shown), 0.8 * WIDTH), layout="constrained")
    for axes, (row, run) in zip(figure.subplots(1, len(shown), squeeze=False)[0], shown, strict=True):
        with opened_run(run) as opened:
            _draw_run(axes, row, opened)
    figure.axes[0].legend(fontsize=7, loc="lower left")
    caption = (
        f"The person with the median distance in each condition, with {counted(table.levels()[0], 'object')}: the "
        "route that was planned at the start, and the one that was walked, in the house seen from above; metres walked "
        "in the titles."
    )
    return framed(figure, "Planned and walked paths", table.origin, caption)


def median_people(table: StudyTable) -> Iterator[Any]:
    """Yield the participant with the median walking distance for each condition and the fewest objects."""
    if DISTANCE not in table.columns:
        return
    walked, least = table.columns[DISTANCE], table.levels()[0]
    for condition in table.conditions():
        here = np.flatnonzero((table.assistance == condition) & (table.objects == least) & ~np.isnan(walked))
        if len(here):
            yield table.rows[here[np.argsort(walked[here], kind="stable")[(len(here) - 1) // 2]]]


def _run_of(row: Any, folder: Path) -> Path | None:
    """Find the run of a table row, by participant if possible, because fingerprints need not be unique."""
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
        f"{row['assistance']}, {counted(row['objects'], 'object')}: {row['task_distance_m']:.0f} m",
        fontsize=9,
    )
