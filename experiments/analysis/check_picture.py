"""Draw the figures of the commands `mjsim check` and `mjsim import episodes`."""

import textwrap
from collections import Counter
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mjsim.house.check import CheckReport
from mjsim.house.scene.disorder import Disorder
from mjsim.house.validation.findings import Finding
from mjsim.house.validation.views import Drawing
from mjsim.support.files import replacing

SIDE = 9.0  # width of a figure with a single view, in inches
MAX_LINES = 100  # maximum number of listed findings, because image viewers cannot open very tall images
LETTERS_PER_INCH = 13.0
COLOURS = {"error": "#D55E00", "warning": "#E69F00"}


def draw_check(path: Path, report: CheckReport) -> None:
    """Draw the views of a check report with a list of its findings, and save the figure as a PNG file."""
    views = report.views or (Drawing("nothing could be compiled", (0, 1), ()),)
    listed = [f"{n}. {f}" for n, f in enumerate(report.findings[:MAX_LINES], 1)]
    if len(report.findings) > MAX_LINES:
        listed.append(f"and {len(report.findings) - MAX_LINES} more: `mjsim check` prints them all")
    wide = SIDE * (1.0 if len(views) == 1 else 1.4)
    text = "\n".join(textwrap.fill(line, int(wide * LETTERS_PER_INCH)) for line in listed) or "no findings"
    below = 0.3 + 0.145 * (text.count("\n") + 1)
    figure = Figure(figsize=(wide, SIDE * 0.7 + below), dpi=100)
    base = below / figure.get_figheight()
    for column, view in enumerate(views):
        width = 1.0 / len(views)
        axes = figure.add_axes((column * width + 0.03, base + 0.02, width - 0.05, 0.92 - base))
        _draw_view(axes, view, report.findings)
    figure.text(0.03, base - 0.01, text, va="top", fontsize=8, family="monospace")
    with replacing(path) as temporary:
        figure.savefig(temporary, format="png", metadata={"Software": "mjsim"})


def _draw_view(axes: Axes, view: Drawing, findings: tuple[Finding, ...]) -> None:
    for label, corners in view.rooms:
        axes.fill(*corners.T, facecolor="#EEF3F7", edgecolor="#9AA7B2", lw=0.8, zorder=0)
        axes.annotate(label, corners.mean(axis=0), ha="center", va="center", color="#60707C", fontsize=8)
    for outline in view.outlines:
        axes.fill(*outline.T, facecolor="#B9BEC3", edgecolor="#6B7075", lw=0.4, alpha=0.8, zorder=1)
    for name, point in view.marks.items():
        axes.plot(*point, marker="o", ms=4, color="#0072B2", ls="", zorder=3)
        axes.annotate(name, point, xytext=(4, 3), textcoords="offset points", fontsize=6, color="#0072B2")
    drawn = [c for _, c in view.rooms] + list(view.outlines)
    if drawn:
        points = np.concatenate(drawn)
        low, high = points.min(axis=0), points.max(axis=0)
        margin = 0.05 * float((high - low).max()) + 1e-3
        axes.set(xlim=(low[0] - margin, high[0] + margin), ylim=(low[1] - margin, high[1] + margin))
    for number, finding in enumerate(findings, 1):
        if finding.place is None or len(finding.place) <= max(view.axes):
            continue
        at = _within(axes, finding.place[view.axes[0]], finding.place[view.axes[1]])
        box = {"boxstyle": "circle,pad=0.15", "fc": COLOURS[finding.severity], "ec": "white"}
        axes.annotate(
            str(number), at, ha="center", va="center", color="white", fontsize=8, bbox=box, zorder=4
        )
    axes.set(title=f"{view.title}, m", aspect="equal")
    axes.tick_params(labelsize=7)


def _within(axes: Axes, x: float, y: float) -> tuple[float, float]:
    return float(np.clip(x, *axes.get_xlim())), float(np.clip(y, *axes.get_ylim()))


_KINDS = 15  # maximum number of object types in the bar chart
_BLUE = "#0072B2"


def draw_disorder(path: Path, disorder: Disorder, kinds: Mapping[str, int]) -> None:
    """Save charts of the misplaced objects in a set of episodes as a PNG. `kinds` counts them by type."""
    figure = Figure(figsize=(11, 3.4), dpi=100, layout="constrained")
    many, far, which = figure.subplots(1, 3)
    counts = Counter(disorder.misplaced)
    many.bar(list(counts), [100 * n / len(disorder.misplaced) for n in counts.values()], color=_BLUE)
    many.set(xlabel="objects out of place", ylabel="% of episodes")
    if disorder.distances:
        far.hist(disorder.distances, bins=np.arange(0, max(disorder.distances) + 0.5, 0.5), color=_BLUE)
        far.axvline(float(np.median(disorder.distances)), color="#D55E00", lw=1.5)
    far.set(xlabel="distance from its place, m (line: median)", ylabel="objects")
    names = sorted(kinds, key=lambda kind: (-kinds[kind], kind))[:_KINDS][::-1]
    which.barh(names, [kinds[name] for name in names], color=_BLUE)
    which.tick_params(axis="y", labelsize=7)
    which.set(xlabel="times out of place")
    for axes in (many, far, which):
        axes.spines[["top", "right"]].set_visible(False)
    with replacing(path) as temporary:
        figure.savefig(temporary, format="png", metadata={"Software": "mjsim"})
