"""A score as a page, a table and JSON."""

import csv
import io
from collections.abc import Iterable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

from experiments.analysis.page import Block, Paragraph, page, table
from experiments.record.files import write_json
from mjsim.files import write_text_atomically
from studies.published import Published
from studies.score import REPLICATES, Row, Score, inconsistencies

PAGE, JSON, CSV = "score.html", "score.json", "score.csv"
FILES = (PAGE, JSON, CSV)
COLUMNS = ("what", "objects", "published", "partial η²", "ours", "agrees", "reproduced", "remark")
TITLE = "Score against the published study"


def write_score(folder: Path, score: Score, published: Published) -> None:
    """Write all files, each whole or not at all."""
    folder.mkdir(parents=True, exist_ok=True)
    write_json(folder / JSON, as_json(score, published))
    write_text_atomically(folder / CSV, _csv(score))
    write_text_atomically(folder / PAGE, score_page(score, published))


def as_json(score: Score, published: Published) -> dict[str, Any]:
    """All of it."""
    names = ("what", "rows", "agree", "of")
    return {
        **asdict(score),
        "summary": [dict(zip(names, line, strict=True)) for line in score.summary()],
        "inconsistent": inconsistencies(published),
    }


def score_page(score: Score, published: Published) -> str:
    """The page: a summary, then fitted and held-out rows apart."""
    return page(TITLE, score.origin, _sections(score, published))


def _sections(score: Score, published: Published) -> Iterator[tuple[str, Iterable[Block]]]:
    yield "Summary", (Paragraph(how(score)), table(("", "rows", "agree", "of"), score.summary()))
    for held_out, title in ((False, "6 objects: may be fitted"), (True, "All numbers of objects: held out")):
        rows = [cells(row) for row in score.rows if row.held_out == held_out]
        yield title, (table(COLUMNS, rows),)
    yield "Inconsistent in the published numbers", map(Paragraph, inconsistencies(published))


def how(score: Score) -> str:
    """How the study was judged."""
    if score.pool:
        return (
            f"A pool of {score.people} people, judged as a population; `reproduced` is the share of {REPLICATES} "
            "studies of the published size, drawn from it, that come out as published."
        )
    judged = f"A study of {score.people} people, judged by its own tests."
    if score.as_published:
        return judged
    return f"{judged} Its cells are not of the published sizes, on which decisions of tests depend."


def cells(row: Row) -> tuple[object, ...]:
    """A row of the table, as COLUMNS."""
    agrees = {None: None, True: "yes", False: "NO"}[row.agrees]
    rate = None if row.rate is None else f"{row.rate:.0%}"
    target = row.target if row.kind == "effect size" else None
    what = f"{row.measure}: {row.what} ({row.kind})"
    return what, row.objects, row.published, target, row.ours, agrees, rate, row.remark


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
