"""Worked example: test whether the published differences between conditions hold in 200 homes.

    mjsim study simulate studies/examples/many_homes.toml --out runs/homes
    python -m studies.examples.many_homes runs/homes

In this example, each of 300 simulated participants tidies four of 200 generated homes. The script prints the
differences between conditions with intervals that generalize over homes, the share of homes whose difference
has the same sign as the average, and the shares of the variance between people and between homes. It also
draws homes.png in the folder of the trials, which shows the difference between optimal guidance and none for
each home by its number of rooms. All data are simulated.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray
from rich.console import Console

from experiments.analysis.comparison_plot import mark_origin
from experiments.analysis.statistics.mixed import differences_by_house, mixed_model
from experiments.analysis.study.analysis import random_factors
from experiments.analysis.study.measures import read_measures
from experiments.analysis.study.table import StudyTable, read_study
from mjsim.support.files import replacing

FIRST, SECOND = "none", "optimal"  # conditions whose difference is drawn


def differences(table: StudyTable, name: str, first: str, second: str) -> dict[str, float]:
    """Return the mean difference between two conditions for each house in which both were measured."""
    values, found = table.columns[name], {}
    for house in dict.fromkeys(table.houses.tolist()):
        here = (table.houses == house) & ~np.isnan(values)
        means = [values[here & (table.assistance == c)] for c in (first, second)]
        if all(map(len, means)):
            found[house] = float(means[1].mean() - means[0].mean())
    return found


def lines(table: StudyTable, name: str) -> list[str]:
    """Return lines of text that report the results for a measure."""
    here = table.take(np.flatnonzero(~np.isnan(table.columns[name])))
    values, said = here.columns[name], []
    of_all = here.assistance, here.objects
    for d in differences_by_house(values, *of_all, here.houses, here.conditions()):
        each = np.array(list(differences(here, name, d.first, d.second).values()))
        same = float((np.sign(each) == np.sign(d.difference)).mean())
        low, high = d.interval
        said.append(
            f"{name}: {d.second} - {d.first} {d.difference:.3g} [{low:.3g}, {high:.3g}], so in {same:.0%} of homes"
        )
    model = mixed_model(values, *of_all, random_factors(here))
    test = model.tests["assistance"]
    said.append(f"{name}: F({test.df1}, {test.df2:.0f}) = {test.statistic:.1f}, p = {test.p:.2g}")
    for factor, found in model.random.items():
        low, high = found.interval or (np.nan, np.nan)
        said.append(f"{name}: {factor} {found.share:.1%} [{low:.1%}, {high:.1%}] of the variance")
    return said


def draw(path: Path, table: StudyTable, names: Sequence[str]) -> None:
    """Draw a point for each home by its number of rooms, and the mean for each number of rooms."""
    rooms: dict[str, float] = dict(zip(table.houses.tolist(), table.numbers("rooms").tolist(), strict=True))
    figure = Figure(figsize=(3.2 * len(names), 3.2), layout="constrained")
    FigureCanvasAgg(figure)
    for axes, name in zip(figure.subplots(1, len(names), squeeze=False)[0], names, strict=True):
        found = differences(table, name, FIRST, SECOND)
        x, y = np.array([rooms[house] for house in found]), np.array(list(found.values()))
        jitter = 0.12 * np.sin(np.arange(len(x)) * 2.4)
        axes.plot(x + jitter, y, ".", color="#0072B2", ms=4, alpha=0.5)
        axes.plot(*_means(x, y), "o", color="black", ms=5)
        axes.axhline(0.0, color="#999999", lw=0.8)
        axes.set_xlabel("rooms")
        axes.set_title(table.sources[name], fontsize=9)
        axes.spines[["top", "right"]].set_visible(False)
    figure.axes[0].set_ylabel(f"{SECOND} - {FIRST}")
    mark_origin(figure, table.origin)
    with replacing(path) as temporary:
        figure.savefig(temporary, format="png", dpi=110, metadata={"Software": "mjsim"})


def _means(x: NDArray[np.float64], y: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    levels = np.unique(x)
    return levels, np.array([y[x == level].mean() for level in levels])


def main() -> None:
    """Print the results of the trials in a folder, and draw them."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path, metavar="DIR", help="of `mjsim study simulate`")
    folder = parser.parse_args().folder
    console = Console(highlight=False, markup=False, soft_wrap=True)
    measures = read_measures()
    table = read_study(folder, measures)
    names = [name for name in measures.objective if name in table.columns]
    draw(folder / "homes.png", table, names)
    console.print(f"{table.origin}: {len(table.rows)} trials in {len(set(table.houses.tolist()))} homes.")
    for name in names:
        for line in lines(table, name):
            console.print(line)


if __name__ == "__main__":
    main()
