"""Plot paired trials as lines, and the mean of each condition with its confidence interval."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from experiments.analysis.comparison import Block, batch_origin, mean_interval
from mjsim.support.files import replacing

PANEL = (2.6, 2.4)  # size of a panel, in inches
PAIR, MEAN = "#9AA5B1", "#0072B2"
LABELS = {"ipl_locations": "inverse path length", "nd_feasible": "normalized deviations"}
UNITS = {"_s": "s", "_m": "m"}
CAPTION = "grey: a person under each condition; blue: mean and 95 % confidence interval (t)"


def draw_comparison(path: Path, blocks: Sequence[Block], metrics: Sequence[str]) -> None:
    """Plot a grid of panels with a row per block and a column per metric. The file suffix sets the format."""
    size = PANEL[0] * len(metrics), PANEL[1] * len(blocks) + 0.5
    figure = Figure(figsize=size, layout="constrained")
    panels = figure.subplots(len(blocks), len(metrics), squeeze=False)
    for block, row in zip(blocks, panels, strict=True):
        for metric, axes in zip(metrics, row, strict=True):
            _draw_panel(axes, block, metric)
        row[0].set_ylabel(block.label.replace(", ", "\n"), fontsize=8)
    for metric, axes in zip(metrics, panels[0], strict=True):
        axes.set_title(axis_label(metric), fontsize=9)
    figure.supxlabel(CAPTION, fontsize=7)
    mark_origin(figure, batch_origin(blocks))
    with replacing(path) as temporary:
        # Omit the creation date so that the same data always give the same file.
        metadata = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}.get(path.suffix, {})
        figure.savefig(temporary, dpi=150, metadata=metadata)


def axis_label(metric: str) -> str:
    unit = UNITS.get(metric[-2:])
    words = LABELS.get(metric, (metric[:-2] if unit else metric).replace("_", " "))
    return f"{words} ({unit})" if unit else words


def _draw_panel(axes: Axes, block: Block, metric: str) -> None:
    names = list(block.rows)
    for seeds in sorted({seeds for rows in block.rows.values() for seeds in rows}):
        values = [block.rows[name].get(seeds, {}).get(metric) for name in names]
        axes.plot(
            range(len(names)),
            [np.nan if v is None else v for v in values],
            color=PAIR,
            lw=0.7,
            marker=".",
            ms=3,
        )
    for place, name in enumerate(names):
        known = np.array([row[metric] for row in block.rows[name].values() if row[metric] is not None], float)
        if known.size:
            low, high = mean_interval(known) or (known.mean(), known.mean())
            axes.errorbar(
                place,
                known.mean(),
                [[known.mean() - low], [high - known.mean()]],
                fmt="o",
                color=MEAN,
                capsize=4,
            )
    axes.set_xticks(range(len(names)), names, fontsize=8)
    axes.tick_params(axis="y", labelsize=7)
    axes.margins(x=0.2)


def mark_origin(figure: Figure, origin: str) -> None:
    """Add a line at the top of a figure that states the origin of the data, such as "Simulated"."""
    figure.suptitle(origin, fontsize=8, x=0.99, ha="right", color="#B00020")
