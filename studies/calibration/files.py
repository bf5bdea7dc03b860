"""Write the results of a calibration as a web page, a JSON file, a table and a study file."""

import csv
import io
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from experiments.analysis.page import Block, FigureBlock, Paragraph, page, table
from experiments.analysis.report.figures import framed
from experiments.analysis.study.robustness import left_out_table
from experiments.record.files import write_json
from mjsim.support.files import write_text_atomically
from studies.calibration.calibrate import Calibration, fitted_study
from studies.calibration.inference import missed_orders

PAGE, JSON, KEPT, STUDY = "calibration.html", "calibration.json", "kept.csv", "study.toml"
FILES = (PAGE, JSON, KEPT, STUDY)
TITLE = "Calibration on the rows at 6 objects"
INTERVAL = (5, 50, 95)  # percentiles in tables
COLUMNS = 4  # number of panels in a row
PRIOR_AND_KEPT = (
    "Distribution of each free parameter (units in studies/calibration.toml) over the draws from its prior (grey) and "
    "over those that are kept (blue); the best draw (orange)."
)
CAUTION = (
    "Only rows at 6 objects were looked at. A parameter that is not identified has a value because it must have one; "
    "others would do as well. Nothing here measures people."
)


def write_calibration(folder: Path, found: Calibration, study: Path) -> None:
    """Write the page, the JSON file, the table of kept draws and the study file, each atomically.

    Args:
        folder: The output folder.
        found: The calibration.
        study: The study file to which the best population is added.

    Raises:
        RecordError: The study file already describes a population.
    """
    about = (
        f"by `mjsim study calibrate` to the rows at 6 objects: {len(found.fit.draws)} draws, seed {found.seed}, from "
        f"{sum(s.people for s in found.surrogates.values())} simulated people."
    )
    text = fitted_study(study, found.behaviour(), about)
    folder.mkdir(parents=True, exist_ok=True)
    write_json(folder / JSON, as_json(found))
    write_text_atomically(folder / KEPT, _kept_csv(found))
    write_text_atomically(folder / STUDY, text)
    write_text_atomically(folder / PAGE, page(TITLE, found.origin, _sections(found)))


def as_json(found: Calibration) -> dict[str, Any]:
    """Return the calibration as JSON-ready data, without its draws."""
    return {
        "origin": found.origin,
        "seed": found.seed,
        "draws": len(found.fit.draws),
        "kept": len(found.fit.kept),
        "surrogates": [
            dict(zip(("condition", "measure", "people", "left_out_r2"), row, strict=True))
            for row in surrogate_rows(found)
        ],
        "parameters": [
            dict(zip(("name", "prior", "kept", "best", "contraction", "verdict"), row, strict=True))
            for row in parameter_rows(found)
        ],
        "trade_offs": found.trade_offs(),
        "effects": [dict(zip(("measure", "target", "best"), row, strict=True)) for row in effect_rows(found)],
        "missed_orders": _missed(found),
        "left_out": [asdict(person) for person in found.left_out],
        "behaviour": found.behaviour().as_dict(),
    }


def parameter_rows(found: Calibration) -> Iterator[tuple[Any, ...]]:
    """Yield each parameter's name, prior and kept percentiles, best value, contraction, and verdict."""
    fit = found.fit
    for k, (name, contraction, verdict) in enumerate(
        zip(found.free.priors, fit.contraction().tolist(), found.identified(), strict=True)
    ):
        prior, kept = (
            tuple(np.percentile(d, INTERVAL).tolist()) for d in (fit.draws[:, k], fit.draws[fit.kept, k])
        )
        yield name, prior, kept, float(fit.draws[fit.best, k]), contraction, verdict


def surrogate_rows(found: Calibration) -> Iterator[tuple[Any, ...]]:
    """Yield each condition and measure with the number of participants and the explained variance."""
    for condition, surrogate in found.surrogates.items():
        for measure, predicted in zip(found.rows.measures(), surrogate.left_out_r2.tolist(), strict=True):
            yield condition, measure, surrogate.people, predicted


def effect_rows(found: Calibration) -> Iterator[tuple[Any, ...]]:
    """Yield each measure with its published interval and the best population's partial eta squared."""
    for k, test in enumerate(found.rows.tests):
        yield test.measure, test.interval(found.rows.people), float(found.fit.eta_squared[found.fit.best, k])


def _sections(found: Calibration) -> Iterator[tuple[str, Iterable[Block]]]:
    fit, names = found.fit, list(found.free.priors)
    yield (
        "Summary",
        (
            Paragraph(CAUTION),
            Paragraph(
                f"{len(fit.draws)} populations were drawn from the priors; the {len(fit.kept)} whose studies are "
                "nearest to the published one are kept."
            ),
            table(("measure", "published partial η²", "best population"), effect_rows(found)),
            Paragraph(
                f"Of {len(found.rows.orders())} published orders, the best population misses: "
                f"{'; '.join(_missed(found)) or 'none'}."
            ),
        ),
    )
    yield "People who are left out", (left_out_table(found.left_out),)
    yield (
        "What is identifiable",
        (
            table(
                ("parameter", "prior 5, 50, 95 %", "kept 5, 50, 95 %", "best", "contraction", ""),
                parameter_rows(found),
            ),
            prior_and_kept(found),
            table(("parameter", "trades off with", "rank correlation"), found.trade_offs()),
        ),
    )
    sensitivity: Sequence[Any] = fit.sensitivity().tolist()
    yield (
        "What moves what: rank correlation with the effect sizes, over the priors",
        (
            table(
                ("parameter", *found.rows.measures()),
                [(n, *row) for n, row in zip(names, sensitivity, strict=True)],
            ),
        ),
    )
    yield (
        "How well the surrogate predicts people that it was not fitted to",
        (
            table(
                ("condition", "measure", "people", "share of variance predicted"),
                surrogate_rows(found),
            ),
            Paragraph("What is not predicted is chance within people; it enters as variance."),
        ),
    )


def _missed(found: Calibration) -> list[str]:
    missed = missed_orders(found.fit.outcome, found.rows)[found.fit.best]
    return [order for order, one in zip(found.rows.orders(), missed, strict=True) if one]


def prior_and_kept(found: Calibration) -> FigureBlock:
    """Draw a panel for each parameter with its prior, the kept draws and the best value."""
    names, fit = list(found.free.priors), found.fit
    lines = -(-len(names) // COLUMNS)
    figure = Figure(figsize=(2.4 * COLUMNS, 1.5 * lines), layout="constrained")
    panels = figure.subplots(lines, COLUMNS, squeeze=False).ravel()
    for k, axes in enumerate(panels):
        axes.set_yticks([])
        axes.tick_params(labelsize=7)
        axes.spines[["top", "right", "left"]].set_visible(False)
        axes.set_visible(k < len(names))
    for k, name in enumerate(names):
        edges: NDArray[np.float64] = np.linspace(fit.draws[:, k].min(), fit.draws[:, k].max(), 21)
        panels[k].hist(fit.draws[:, k], edges, density=True, color="#CCCCCC", label="prior")
        panels[k].hist(
            fit.draws[fit.kept, k], edges, density=True, histtype="step", color="#0072B2", label="kept"
        )
        panels[k].axvline(fit.draws[fit.best, k], color="#D55E00", lw=1.2, label="best")
        panels[k].set_title(name, fontsize=8)
    panels[0].legend(fontsize=6, frameon=False)
    return framed(figure, "Free parameters before and after", found.origin, PRIOR_AND_KEPT)


def _kept_csv(found: Calibration) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(("origin", "distance", *found.free.priors))
    for k in found.fit.kept:
        writer.writerow((found.origin, found.fit.distance[k], *found.fit.draws[k]))
    return text.getvalue()
