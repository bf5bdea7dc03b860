"""Export a study as a Psych-DS data set (psych-ds.github.io) with tables, runs and a codebook."""

import re
import shutil
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import msgspec

from experiments.analysis.study.measures import LIKERT_PREFIX
from experiments.errors import RecordError
from experiments.record.files import csv_text, replacing_folder, write_json
from experiments.study.data.collect import FREE, Collected, collect, harmless, person_name
from experiments.study.data.copies import INDEX, note_copy
from experiments.study.file import Study
from experiments.trials.table import trial_columns
from experiments.visit.plan import SURVEY
from experiments.visit.procedure import ATTEMPTS
from experiments.visit.store import Answer, PersonRow, Store
from experiments.visit.texts.items import Item
from mjsim.support.files import write_text_atomically

DESCRIPTION, README, IGNORED = "dataset_description.json", "README.md", ".psychds-ignore"
DATA, RUNS, CODEBOOK = "data", "runs", Path("documentation", "codebook.csv")

Table = Sequence[Mapping[str, Any]]
OWN = {
    "participant": "Number of the participant, the same in all tables and in the names of runs.",
    "platform": "Recruitment platform.",
    "status": "Status of the participation.",
    "arrived": "Time of arrival, UTC.",
    "task_ended": "End of the task, UTC.",
    "phase": "Phase of the study.",
    "order": "Position of the phase in the visit, from 1.",
    "duration_s": "Time from first showing the phase to its end, in seconds; empty if it did not end.",
    "attempts": "Number of attempts at the phase, or 0 if the first form was accepted.",
    "reason": "Reason for the end of the phase.",
    "item": "Name of the item.",
    "answer": "Answer. Scales are numbers from 1. Several choices are joined by semicolons.",
    "recruitment_known": "True if the recruitment platform lists the participant's submission.",
    "inattentive": "Number of wrong answers to survey items with a right answer.",
    "text": "Free-text answer. An apostrophe precedes texts that a spreadsheet would evaluate.",
}


class Variable(msgspec.Struct, frozen=True, omit_defaults=True, tag_field="@type", tag="PropertyValue"):
    """A table column and its description in the codebook.

    Attributes:
        levels: Meaning of each value of a categorical column.
    """

    name: str
    description: str
    low: float | None = msgspec.field(default=None, name="minValue")
    high: float | None = msgspec.field(default=None, name="maxValue")
    levels: tuple[str, ...] = msgspec.field(default=(), name="valueReference")


@dataclass(frozen=True)
class Exported:
    """The summary of an export."""

    people: int
    runs: int
    collected: Collected


async def export(study: Study, store: Store, folder: Path, out: Path, *, replace: bool = False) -> Exported:
    """Export a study to a folder atomically.

    Participants are identified by numbers. The export contains no platform ids, IP addresses, links or hashes of
    links. It omits participants who did not consent or who asked for the deletion of their data.

    Raises:
        RecordError: `out` exists and cannot be replaced, or no participant has finished the task.
    """
    check_export(out, replace=replace)
    found = await collect(study, store, folder)
    if not found.rows:
        raise RecordError(f"no participant in {folder} has finished the task yet; there is nothing to export")
    people = {p.id: p for p in await store.people() if not p.delete_wanted and p.status != "no_consent"}
    trials = [
        row
        for row in await store.trials()
        if row.person_id in people and person_name(people[row.person_id]) not in found.unusable
    ]
    answers = [row for row in await store.answers() if row.final and row.person_id in people]
    tables: dict[str, Table] = {
        "": found.rows,
        "phases": await _phases(store, people, answers),
        "answers": list(_answers(study, answers)),
        "texts": [{"participant": p, "item": item, "text": words} for p, item, words in found.texts],
    }
    with replacing_folder(out, 0o700) as made:
        _write(made, study, {name: table for name, table in tables.items() if table})
        for row in trials:
            shutil.copytree(folder / row.folder, made / RUNS / person_name(people[row.person_id]) / row.phase)
        (made / INDEX).write_bytes((out / INDEX).read_bytes() if (out / INDEX).is_file() else b"")
        for path in made.rglob("*"):
            path.chmod(0o700 if path.is_dir() else 0o600)
        note_copy(folder, "export", out)
    return Exported(len(found.rows), len(trials), found)


def check_export(out: Path, *, replace: bool) -> None:
    """Raise `RecordError` if an export cannot be written to a folder."""
    if not out.exists() or (out.is_dir() and not any(out.iterdir())):
        return
    if not (out / DESCRIPTION).is_file():
        raise RecordError(f"{out} is there and is no export; name a folder that does not exist yet")
    if not replace:
        raise RecordError(f"{out} is an export already; --force replaces it")


async def _phases(store: Store, people: Mapping[int, PersonRow], answers: Iterable[Answer]) -> Table:
    rows: list[dict[str, Any]] = []
    rejected = {(row.person_id, row.phase): row.value for row in answers if row.item == ATTEMPTS}
    order: dict[int, int] = {}
    for phase in sorted(await store.phases(), key=lambda row: (row.person_id, row.shown)):
        if phase.person_id not in people:
            continue
        order[phase.person_id] = number = order.get(phase.person_id, 0) + 1
        rows.append(
            {
                "participant": person_name(people[phase.person_id]),
                "phase": phase.name,
                "order": number,
                "duration_s": phase.duration_s,
                "attempts": rejected.get((phase.person_id, phase.name), 0),
                "reason": phase.reason,
            }
        )
    return rows


def _answers(study: Study, answers: Iterable[Answer]) -> Iterable[dict[str, Any]]:
    kinds = {(name, item.name): item.kind for name, section in study.texts.items() for item in section.items}
    for answer in answers:
        kind, value = kinds.get((answer.phase, answer.item)), answer.value
        if kind in FREE or (kind is None and not isinstance(value, int | float)):
            continue
        shown = "; ".join(value) if isinstance(value, list) else value
        yield {
            "participant": f"p{answer.person_id:05d}", "phase": answer.phase, "item": answer.item, "answer": shown,
        }  # fmt: skip


def _write(out: Path, study: Study, tables: Mapping[str, Table]) -> None:
    short = re.sub("[^a-zA-Z0-9]", "", study.settings.name)
    for name, table in tables.items():
        described = f"_description-{name}" if name else ""
        write_text_atomically(out / DATA / f"study-{short}{described}_data.csv", _escaped(table))
    variables = codebook(study, (column for table in tables.values() for column in table[0]))
    rows = [{"name": v.name, "description": v.description, "values": "; ".join(v.levels)} for v in variables]
    write_text_atomically(out / CODEBOOK, _escaped(rows))
    write_json(out / DESCRIPTION, _description(study, variables))
    write_text_atomically(out / IGNORED, f"{RUNS}/\n{CODEBOOK.parent}/\n{INDEX}\n")
    write_text_atomically(out / README, _readme(study, short))


def _escaped(table: Table) -> str:
    """Format a table as CSV, and escape text that a spreadsheet would evaluate as a formula."""
    safe = [{key: harmless(v) if isinstance(v, str) else v for key, v in row.items()} for row in table]
    return csv_text(list(table[0]), (map(row.get, table[0]) for row in safe))


def _description(study: Study, variables: Sequence[Variable]) -> dict[str, Any]:
    return {
        "@context": "https://schema.org/",
        "@type": "Dataset",
        "name": study.settings.title,
        "description": f"What people did and answered in the study {study.settings.name}, recorded by mjsim "
        f"{version('mjsim')}. Study file: SHA-256 {study.sha256}.",
        "creator": {"@type": "Organization", "name": study.settings.institution},
        "inLanguage": study.settings.language,
        "variableMeasured": msgspec.to_builtins(variables),
    }


def _readme(study: Study, short: str) -> str:
    return f"""\
# {study.settings.title}

| what | where |
|---|---|
| one row per participant who ended the task | `data/study-{short}_data.csv` |
| phases of all participants who gave consent | `data/study-{short}_description-phases_data.csv` |
| answers, one per row | `data/study-{short}_description-answers_data.csv` |
| free-text answers; read them before you publish them | `data/study-{short}_description-texts_data.csv` |
| the meaning of each column | `documentation/codebook.csv`, and `dataset_description.json` |
| journals of trials: `mjsim replay`, `mjsim view` | `runs/PERSON/PHASE/` |

The folder follows Psych-DS. Participants are numbered, and ids of recruitment platforms are left out.
`{INDEX}` lists files made from this folder on this computer. Delete it before you publish the folder.
"""


def codebook(study: Study, columns: Iterable[str]) -> list[Variable]:
    told = {name: what for names, (_, what) in trial_columns().items() for name in names.split(", ")}
    items = {f"{_prefix(item)}{item.name}": item for item in study.texts[SURVEY].items}
    return [_variable(study, name, told, items) for name in dict.fromkeys(columns)]


def _prefix(item: Item) -> str:
    return LIKERT_PREFIX if item.kind == "scale" else "answer_"


def _variable(study: Study, name: str, told: Mapping[str, str], items: Mapping[str, Item]) -> Variable:
    if item := items.get(name):
        if item.kind == "scale":
            scale = study.texts[SURVEY].scale
            levels = tuple(f"{point} = {words}" for point, words in enumerate(scale, 1))
            return Variable(name, item.text, 1, len(scale), levels)
        if item.kind == "number":
            return Variable(name, item.text, item.low, item.high)
        return Variable(name, item.text, levels=tuple(item.choices))
    if name in OWN:
        return Variable(name, OWN[name])
    if name in told:
        return Variable(name, told[name])
    first, _, rest = name.partition("_")
    if first == "phase" and rest.endswith("_s"):
        return Variable(name, f"Duration of the phase {rest.removesuffix('_s')}, in seconds.", 0)
    if first in study.settings.phases:
        return Variable(name, f"{rest}, as given or measured in the phase {first}.")
    if first == "behaviour":
        return Variable(name, told["behaviour_..."])
    return Variable(name, f"{name.replace('_', ' ')}, as mjsim recorded it.")
