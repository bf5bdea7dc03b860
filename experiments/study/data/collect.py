"""Collect the data of a study in a table with one row per participant."""

import hashlib
import os
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from operator import attrgetter
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from experiments.analysis.study.measures import LIKERT_PREFIX, SurveyScale
from experiments.analysis.study.measures import SURVEY as SURVEY_FILE
from experiments.errors import ConfigError, RecordError
from experiments.record.files import csv_text, write_json
from experiments.record.phases import REHEARSAL, TASK
from experiments.record.run_directory import is_run, visit_folders
from experiments.study.data.copies import INDEX
from experiments.study.file import Study
from experiments.trials.table import write_tables
from experiments.trials.trial_reader import read_runs
from experiments.visit.plan import SURVEY
from experiments.visit.store import Answer, PersonRow, PhaseRow, Store, TrialRow
from experiments.visit.texts.items import Item
from mjsim.support.files import write_text_atomically

TEXTS = "texts.csv"
PROCESSES = os.cpu_count() or 1  # number of processes that read runs
FREE = ("line", "text")  # types of survey items with free-text answers
# Control characters and marks of the writing direction, which make a text look different from what it is
INVISIBLE = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u200e\u200f\u202a-\u202e\u2066-\u2069]")
FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n")  # characters that can start a spreadsheet formula
Row = TypeVar("Row", Answer, PhaseRow)
_NAME = re.compile(r"p?(\d{1,9})", re.ASCII)


@dataclass(frozen=True)
class Collected:
    """The collected data of a study.

    Attributes:
        rows: One row per participant who played the task to its end, with measures and answers.
        texts: Free-text answers. Each row contains the participant, the item and the text.
        unfinished: Number of participants who did not play the task to its end, by status.
        unusable: Error message for each participant whose run cannot be read.
        survey: Items on a scale, or None for `mjsim play`.
    """

    rows: Sequence[Mapping[str, Any]]
    texts: Sequence[tuple[str, str, str]]
    unfinished: Mapping[str, int]
    unusable: Mapping[str, str]
    survey: SurveyScale | None = None


async def collect(study: Study, store: Store, folder: Path) -> Collected:
    """Collect the data of all participants whose runs are in `folder`.

    Platform ids are omitted. Participants who asked for the deletion of their data are omitted as well.
    """
    people = [person for person in await store.people() if not person.delete_wanted]
    check_people(study, people)
    trials = {row.person_id: row for row in await store.trials() if row.phase == TASK}
    answers = await store.answers()
    answers_of, phases_of = _by_person(answers), _by_person(await store.phases())
    rows: list[Mapping[str, Any]] = []
    unusable: dict[str, str] = {}
    items = study.texts[SURVEY].items
    finished = [person for person in people if person.id in trials]
    unfinished: Counter[str] = Counter(person.status for person in people if person.id not in trials)
    paths = [folder / trials[person.id].folder for person in finished]
    for person, run in zip(finished, read_runs(paths, PROCESSES), strict=True):
        trial = trials[person.id]
        if isinstance(run, str):
            unusable[person_name(person)] = run
            continue
        about = _about(person, trial, phases_of.get(person.id, ()))
        row = {**about, **run.row, **_answers(items, answers_of.get(person.id, ()))}
        rows.append({key: harmless(value) if isinstance(value, str) else value for key, value in row.items()})
    return Collected(_complete(rows), _texts(items, people, answers), unfinished, unusable, survey_of(study))


def survey_of(study: Study) -> SurveyScale:
    """Return the items of a study's survey that have a rating scale, and the number of points on this scale."""
    section = study.texts[SURVEY]
    return SurveyScale(
        len(section.scale), {item.name: item.text for item in section.items if item.kind == "scale"}
    )


def _by_person(rows: Sequence[Row]) -> Mapping[int, Sequence[Row]]:
    return {person: list(mine) for person, mine in groupby(rows, attrgetter("person_id"))}


def check_people(study: Study, people: Sequence[PersonRow]) -> None:
    """Raise `RecordError` if a study has simulated participants or a rehearsal has real participants."""
    simulated = sum(person.platform == REHEARSAL for person in people)
    if simulated and not study.rehearsal:
        raise RecordError(
            f"{simulated} of {len(people)} people are simulated, with random answers; "
            "name the folder of people, or give `mjsim study collect` the option --rehearsal"
        )
    if study.rehearsal and simulated < len(people):
        raise RecordError(f"{len(people) - simulated} of {len(people)} people are no rehearsal")


def collect_visits(folder: Path) -> Collected:
    """Read the finished tasks from an output folder of `mjsim play`, but no personal links."""
    rows: list[Mapping[str, Any]] = []
    unusable: dict[str, str] = {}
    visits = list(visit_folders(folder))
    tasks = [visit / TASK for visit in visits if is_run(visit / TASK)]
    under_way = len(visits) - len(tasks)
    for path, run in zip(tasks, read_runs(tasks, PROCESSES), strict=True):
        name = visit_name(path.parent.name)
        if isinstance(run, str):
            unusable[name] = run
        else:
            rows.append({"participant": name, **run.row})
    return Collected(_complete(rows), [], {"under way": under_way} if under_way else {}, unusable)


def write_collected(collected: Collected, out: Path) -> Sequence[Path]:
    """Write the tables and the survey into a folder, and return the paths of the tables."""
    out.mkdir(0o700, parents=True, exist_ok=True)
    (out / INDEX).touch(0o600)
    if collected.survey is not None:
        write_json(out / SURVEY_FILE, msgspec.to_builtins(collected.survey))
    texts = ((person, item, harmless(words)) for person, item, words in collected.texts)
    write_text_atomically(out / TEXTS, csv_text(("participant", "item", "text"), texts))
    written = [*write_tables(out, collected.rows), out / TEXTS]
    for path in written:
        path.chmod(0o600)  # the folder may be an older one that others can read
    return written


def person_name(person: PersonRow) -> str:
    """Return the name of a participant in tables, such as `p00012`."""
    return f"p{person.id:05d}"


def visit_name(folder: str) -> str:
    """Return the name that identifies a visit in tables, such as `v1b9c03af`."""
    return f"v{hashlib.sha256(folder.encode()).hexdigest()[:8]}"


def person_number(name: str) -> int:
    """Parse the number in a participant's name, such as `p00012`. Raises ConfigError for any other text."""
    found = _NAME.fullmatch(name)
    if found is None:
        raise ConfigError(f"{name!r} is no person; tables name people like p00012")
    return int(found[1])


def harmless(text: str) -> str:
    """Replace invisible characters, and escape text that a spreadsheet would evaluate as a formula."""
    text = INVISIBLE.sub("\N{REPLACEMENT CHARACTER}", text)
    return f"'{text}" if text.startswith(FORMULA) else text


def _about(person: PersonRow, trial: TrialRow, phases: Sequence[PhaseRow]) -> dict[str, Any]:
    durations = {f"phase_{phase.name}_s": phase.duration_s for phase in phases if phase.name.isidentifier()}
    return {
        "participant": person_name(person),
        "platform": person.platform,
        "status": person.status,
        "arrived": person.created.isoformat(timespec="seconds"),
        "task_ended": trial.finished.isoformat(timespec="seconds"),
        **durations,
    }


def _answers(items: Sequence[Item], answers: Sequence[Answer]) -> dict[str, Any]:
    given = {(answer.phase, answer.item): answer.value for answer in answers if answer.final}
    columns: dict[str, Any] = {}
    for item in items:
        value = given.pop((SURVEY, item.name), None)
        if item.kind == "scale":
            columns[LIKERT_PREFIX + item.name] = value
        elif item.kind == "several":
            columns[f"answer_{item.name}"] = None if value is None else "; ".join(value)
        elif item.kind not in FREE:
            columns[f"answer_{item.name}"] = value
    if checks := [item for item in items if item.right is not None]:
        final = {answer.item: answer.value for answer in answers if answer.final and answer.phase == SURVEY}
        columns["inattentive"] = sum(item.is_wrong(final.get(item.name)) for item in checks)
    for (phase, name), value in given.items():
        if isinstance(value, int | float | bool):
            columns[f"{phase}_{name}"] = value
    return columns


def _texts(
    items: Sequence[Item], people: Sequence[PersonRow], answers: Sequence[Answer]
) -> list[tuple[str, str, str]]:
    free = {item.name for item in items if item.kind in FREE}
    names = {person.id: person_name(person) for person in people}
    return [
        (names[answer.person_id], answer.item, str(answer.value))
        for answer in answers
        if answer.final and answer.phase == SURVEY and answer.item in free and answer.person_id in names
    ]


def _complete(rows: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    columns = dict.fromkeys(name for row in rows for name in row)
    return [{name: row.get(name) for name in columns} for row in rows]
