"""Write a score as a web page, a table and a JSON file."""

import csv
import io
import math
from collections.abc import Iterable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from experiments.analysis.page import Block, Paragraph, p_value, page, table
from experiments.analysis.study.robustness import left_out_table
from experiments.record.files import write_json
from mjsim.support.files import write_text_atomically
from studies.forest import forest
from studies.published import Published, inconsistencies
from studies.score import POOL, TRUTHS, Row, Score
from studies.score_population import REPLICATES

PAGE, JSON, CSV = "score.html", "score.json", "score.csv"
FILES = (PAGE, JSON, CSV)
COLUMNS = (
    *("what", "objects", "published", "goes with η²", "ours", "agrees", "reproduced", "the truth"),
    *("p of published F", "remark"),
)
SUMMARY = ("", "rows", "agree", "judged", "of", "the truth, 5 to 95 %")
NOT_FITTED = (
    "All numbers of objects, not fitted. These rows contain the people at 6 objects, and their authors had seen them: "
    "they are not a test on unseen data."
)
TITLE = "Score against the published study"


def write_score(folder: Path, score: Score, published: Published) -> None:
    """Write the page, the table and the JSON file, each atomically."""
    folder.mkdir(parents=True, exist_ok=True)
    write_json(folder / JSON, as_json(score, published))
    write_text_atomically(folder / CSV, _csv(score))
    write_text_atomically(folder / PAGE, score_page(score, published))


def as_json(score: Score, published: Published) -> dict[str, Any]:
    """Return the score as JSON-ready data, with a summary."""
    names = ("what", "rows", "agree", "judged", "of", "truth")
    return {
        **asdict(score),
        "summary": [dict(zip(names, line, strict=True)) for line in score.summary()],
        "log_score": score.log_score(),
        "inconsistent": inconsistencies(published),
    }


def score_page(score: Score, published: Published) -> str:
    """Return the web page: a summary, a forest plot, and tables of fitted and other results."""
    return page(TITLE, score.origin, _sections(score, published))


def _sections(score: Score, published: Published) -> Iterator[tuple[str, Iterable[Block]]]:
    yield "Summary", (Paragraph(how(score)), table(SUMMARY, score.summary()))
    yield "People who are left out", (left_out_table(score.left_out),)
    yield "Published and ours", (forest(score, published),)
    for fitted, title, about in (
        (True, "6 objects: may be fitted", ()),
        (False, "All numbers of objects: not fitted", (Paragraph(NOT_FITTED),)),
    ):
        yield title, (*about, table(COLUMNS, [cells(row) for row in score.rows if row.fitted == fitted]))
    yield "Inconsistent in the published numbers", map(Paragraph, inconsistencies(published))


def how(score: Score) -> str:
    """Explain in words how the study was judged."""
    if score.pool:
        judged = (
            f"A pool of {score.people} people, judged as a population; `reproduced` is the share of {REPLICATES} "
            "studies of the published size, drawn from it, that come out as published."
        )
    else:
        judged = (
            f"A study of {score.people} people, judged by its own tests. It is one draw: what it decides differs from "
            f"study to study; a pool of {POOL} people in each cell says what its people do."
        )
        if not score.as_published:
            judged += " Its cells are not of the published sizes, on which decisions of tests depend."
    likely = score.log_score()
    low, high = np.quantile(score.log_truths, [0.05, 0.95]) if score.log_truths else (math.nan, math.nan)
    return (
        f"{judged} `The truth`: {TRUTHS} studies of the published size, of people whose F tests are as published on "
        "average, judged likewise."
        + (
            ""
            if likely is None
            else f" Log score of the published F under ours: {likely:.1f} (larger is better; `the truth`: "
            f"{low:.1f} to {high:.1f})."
        )
    )


def cells(row: Row) -> tuple[object, ...]:
    """Return the cells of a table row, in the order of `COLUMNS`."""
    agrees = {None: None, True: "yes", False: "NO"}[row.agrees]
    rate, truth = (None if share is None else f"{share:.0%}" for share in (row.rate, row.truth))
    p = None if row.predictive_p is None else p_value(row.predictive_p)
    target = row.target if row.kind == "effect size" else None
    what = f"{row.measure}: {row.what} ({row.kind})"
    return what, row.objects, row.published, target, row.ours, agrees, rate, truth, p, row.remark


def _csv(score: Score) -> str:
    text = io.StringIO()
    names = list(asdict(score.rows[0]))
    writer = csv.DictWriter(text, ["origin", *names], lineterminator="\n")
    writer.writeheader()
    for row in score.rows:
        writer.writerow(
            {"origin": score.origin, **asdict(row), "target": " ".join(map(str, row.target or ()))}
        )
    return text.getvalue()
