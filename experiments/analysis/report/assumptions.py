"""Report sections that show how results depend on analytical choices and statistical assumptions."""

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy import stats

from experiments.analysis.page import Block, FigureBlock, Paragraph, freedom, p_value, shown, table
from experiments.analysis.report.figures import COLOURS, MAX_DOTS, framed, grid
from experiments.analysis.statistics.effects import ALPHA, FTest
from experiments.analysis.statistics.models import residuals_of
from experiments.analysis.study.analysis import ONE_WAY, TWO_WAY, Analysis, cells_of, tests_of
from experiments.trials.design import counted

FISHER, WELCH, HC3 = "Fisher; Type II", "Welch; Welch-James", "HC3"
ANALYSES = {  # names of analyses by type of result, in the order in which they are shown
    ONE_WAY: FISHER,
    TWO_WAY: FISHER,
    "two-way, Type III": "Type III",
    "welch": WELCH,
    "two-way, Welch-James": WELCH,
    "HC3": HC3,
    "two-way, HC3": HC3,
}
DECIDED = (FISHER, "Type III", WELCH, HC3, "mixed model")
ABOUT = (
    "Analyses of variance assume normal residuals of equal variance. With many people in each cell normality matters "
    "little; unequal variances matter where cells are of unequal size. Welch's test, Welch-James and HC3 do not assume "
    "equal variances; the latter two test unweighted means, as Type III does. The mixed model lets houses differ."
)
DIAGNOSTIC_HEAD = (
    *("measure", "Shapiro-Wilk W", "p", "skewness", "excess kurtosis", "equal variances: Brown-Forsythe F"),
    *("df", "p", "smallest SD (cell)", "largest SD (cell)"),
)
SIGNIFICANT = COLOURS[2]
COLUMN, ROW = 0.11, 0.17  # width and height of a matrix cell, in inches


class Specification(NamedTuple):
    """One way of analysing a measure, with the result of the test."""

    reading: str  # table column from which the measure is read
    analysis: str
    test: FTest


def specification_curve(analysis: Analysis, name: str, label: str) -> FigureBlock | None:
    """Draw a specification curve of all effects on a measure, or return None if no effect was tested.

    Source: Simonsohn, Simmons and Nelson 2020, doi:10.1038/s41562-020-0912-z.
    """
    groups = _specifications(analysis, name)
    if not groups:
        return None
    choices = _choices(analysis, groups)
    width, height = sum(map(len, groups.values())) * COLUMN + 2.2, len(choices) * ROW
    figure = Figure(figsize=(max(width, 6.0), height + 3.0), layout="constrained")
    panels = figure.subplots(
        2, len(groups), squeeze=False, sharex="col", sharey="row",
        width_ratios=[len(found) for found in groups.values()], height_ratios=[2.4, height],
    )  # fmt: skip
    for upper, lower, (title, found) in zip(*panels, groups.items(), strict=True):
        _draw_estimates(upper, found)
        _draw_choices(lower, found, choices)
        upper.set_title(title, fontsize=8)
    panels[0, 0].set_ylabel("partial η²", fontsize=9)
    panels[0, 0].set_ylim(bottom=0.0)
    panels[1, 0].set_yticks(range(len(choices)), choices, fontsize=7)
    panels[1, 0].set_ylim(len(choices) - 0.5, -0.5)
    caption = (
        f"{label}: each column is one analysis of one reading; the dots below say which, the scored reading first. "
        "Estimates with 90 % confidence intervals; filled where p < .05. Effect sizes of Welch and HC3 count the "
        "variance of each group in units of its own, those of Fisher, Type II and Type III the variance of all."
    )
    return framed(figure, f"Specification curve of {label.lower()}", analysis.table.origin, caption)


def _specifications(analysis: Analysis, name: str) -> dict[str, list[Specification]]:
    readings = [name, *analysis.measures.objective[name].others]
    found: dict[str, list[Specification]] = {}
    for result in analysis.results:
        if result.measure in readings and result.kind in ANALYSES:
            for effect, test in tests_of(result):
                where = f"{effect},\n{counted(result.objects, 'object') if result.objects else 'all objects'}"
                if isinstance(test, FTest):
                    column = analysis.table.sources[result.measure]
                    found.setdefault(where, []).append(Specification(column, ANALYSES[result.kind], test))
    return {where: sorted(some, key=lambda s: s.test.eta_squared) for where, some in found.items()}


def _choices(analysis: Analysis, groups: dict[str, list[Specification]]) -> list[str]:
    used = [one for found in groups.values() for one in found]
    readings = [c for c in analysis.table.sources.values() if c in {one.reading for one in used}]
    return readings + [a for a in dict.fromkeys(ANALYSES.values()) if a in {one.analysis for one in used}]


def _draw_estimates(axes: Axes, found: list[Specification]) -> None:
    for place, (_, _, test) in enumerate(found):
        low, high = test.interval or (test.eta_squared, test.eta_squared)
        axes.plot([place, place], [low, high], color="#999999", lw=1.2)
        face = SIGNIFICANT if test.p < ALPHA else "white"
        axes.plot(place, test.eta_squared, "o", ms=4, color=SIGNIFICANT, mfc=face)
    axes.set_xlim(-0.8, len(found) - 0.2)
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(labelsize=7)


def _draw_choices(axes: Axes, found: list[Specification], choices: list[str]) -> None:
    places = [(x, choices.index(c)) for x, one in enumerate(found) for c in (one.reading, one.analysis)]
    axes.plot(*np.array(places).T, "o", color="black", ms=3)
    axes.hlines(range(len(choices)), -0.8, len(found) - 0.2, color="#EEEEEE", lw=0.8, zorder=0)
    axes.set_xticks([])
    axes.tick_params(length=0)
    axes.spines[["top", "right", "bottom", "left"]].set_visible(False)


def _residuals(analysis: Analysis, labels: Mapping[str, str]) -> FigureBlock:
    figure = Figure(figsize=(3.0 * len(labels), 5.0), layout="constrained")
    panels = grid(figure, 2, len(labels))
    for (upper, lower), (name, label) in zip(panels.T, labels.items(), strict=True):
        cells = cells_of(analysis.table, name)
        left = residuals_of(cells)
        means = np.repeat([v.mean() for v in cells.values()], [len(v) for v in cells.values()])
        spread = float(left.std()) or 1.0
        upper.plot(
            means, left / spread, ".", color="#666666", ms=3, alpha=0.6, rasterized=len(left) > MAX_DOTS
        )
        upper.axhline(0.0, color="black", lw=0.8)
        upper.set_xlabel(f"mean of the cell: {label}", fontsize=8)
        theory, ordered = stats.probplot(left / spread, fit=False)
        lower.plot(theory, ordered, ".", color="#666666", ms=3, rasterized=len(left) > MAX_DOTS)
        lower.plot(theory, theory, color="black", lw=0.8)
        lower.set_xlabel("quantile of the normal distribution", fontsize=8)
    for axes in panels[:, 0]:
        axes.set_ylabel("residual (standard deviations)", fontsize=8)
    caption = (
        "Above: residuals by the mean of their cell; they should spread equally. Below: residuals in order against the "
        "quantiles of a normal distribution; they should lie on the line."
    )
    return framed(figure, "Residuals", analysis.table.origin, caption)


def assumptions(analysis: Analysis, labels: Mapping[str, str]) -> Iterator[Block]:
    """Yield tables and figures that describe the residuals, and the results under weaker assumptions."""
    found = {r.measure: r.value for r in analysis.results if r.kind == "diagnostics" and r.value}
    if not found:
        return
    yield Paragraph(ABOUT)
    rows = [
        (
            *(labels[name], d.shapiro_wilk, p_value(d.shapiro_wilk_p), d.skewness, d.kurtosis),
            *(d.equal_variances.statistic, freedom(d.equal_variances), p_value(d.equal_variances.p)),
            *(f"{shown(spread)} ({cell})" for cell, spread in (d.smallest_deviation, d.largest_deviation)),
        )
        for name, d in found.items()
    ]
    yield table(DIAGNOSTIC_HEAD, rows)
    yield _residuals(analysis, {name: labels[name] for name in found})
    head = ("measure", "effect", "objects", *(f"p: {kind}" for kind in DECIDED), "decisions at .05")
    yield table(head, [row for name in labels for row in _decisions(analysis, name, labels[name])])


def _decisions(analysis: Analysis, name: str, label: str) -> Iterator[tuple[object, ...]]:
    found: dict[tuple[str, int | None], dict[str, float]] = {}
    for result in (r for r in analysis.results if r.measure == name):
        for effect, test in tests_of(result):
            kind = ANALYSES.get(result.kind, result.kind)
            found.setdefault((effect, result.objects), {})[kind] = test.p
    for (effect, objects), p in found.items():
        each = [p.get(kind) for kind in DECIDED]
        sides = {one < ALPHA for one in each if one is not None}
        same = "the same" if len(sides) < 2 else "differ"
        yield (label, effect, objects or "all", *map(p_value, each), same)
