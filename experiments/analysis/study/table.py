"""The people of a study: one row each of trials.parquet, as plain columns."""

import difflib
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.analysis.study.measures import (
    FILE,
    LIKERT_PREFIX,
    Measures,
    present_columns,
    resolve,
    unread_note,
)
from experiments.errors import RecordError
from experiments.record.files import read_json
from experiments.record.phases import ALL_DELIVERED, RECORDED, REHEARSED, TASK, origin_of
from experiments.record.run_directory import VISIT, is_run, visit_folders
from experiments.trials.batch_folder import read_trial
from experiments.trials.design import confounded_rows, counted
from experiments.trials.exclusions import Exclusions, LeftOut, left_out, person_name
from experiments.trials.table import NAME, read_rows
from experiments.trials.trial_config import SEEDS

ANALYSIS = "analysis"  # its usual folder
REPORT, STATISTICS, PEOPLE, TESTS = "report.html", "stats.json", "people", "tests.csv"
FILES = (REPORT, STATISTICS, f"{PEOPLE}.parquet", f"{PEOPLE}.csv", TESTS)  # of an analysis
REQUIRED = ("assistance", "objects", "user")
CONDITIONS = ("none", "highlight", "optimal")  # of the paper, in its order
SHOWN = 20  # people in a line
ANSWERS = (1, 5)  # of Likert items, from and to


@dataclass(frozen=True)
class Gap:
    """People without a finite value of a measure; its tests leave them out."""

    measure: str
    value: str  # `missing` or `infinite`
    people: tuple[str, ...]


@dataclass(frozen=True)
class StudyTable:
    """People of a study, in the order of its table."""

    rows: Sequence[Mapping[str, Any]]  # their rows, with all columns of the file
    assistance: NDArray[Any]  # assistance condition of each, (n,)
    objects: NDArray[np.int64]  # number of objects of each, (n,)
    houses: NDArray[Any]  # name of the disorganized house of each, (n,)
    people: NDArray[Any]  # who it is, (n,): the same name in several rows for a person with several trials
    # measures and answers by short name, (n,) each; NaN where unknown
    columns: Mapping[str, NDArray[np.float64]]
    sources: Mapping[str, str]  # column of the file by short name
    origin: str  # whether people were simulated: `Simulated`, `Partly simulated` or `Recorded from people`
    notes: tuple[str, ...]  # remarks about the table, a sentence each
    left_out: tuple[LeftOut, ...]  # people of the file who are no people of this table
    gaps: tuple[Gap, ...]  # values that are not known

    def conditions(self) -> list[str]:
        """Assistance conditions, those of the paper first and in its order."""
        present = dict.fromkeys(self.assistance.tolist())
        return [c for c in CONDITIONS if c in present] + [c for c in present if c not in CONDITIONS]

    def levels(self) -> list[int]:
        """Numbers of objects, rising."""
        return sorted(set(self.objects.tolist()))

    def take(self, people: NDArray[np.int64]) -> "StudyTable":
        """The people of these numbers, (m,), which may repeat."""
        return replace(
            self,
            rows=[self.rows[k] for k in people],
            assistance=self.assistance[people],
            objects=self.objects[people],
            houses=self.houses[people],
            people=self.people[people],
            columns={name: values[people] for name, values in self.columns.items()},
        )

    def groups(self, name: str, objects: int | None = None) -> dict[str, NDArray[np.float64]]:
        """Known values of a column by condition, of one level or all; conditions without any are left out."""
        values, known = self.columns[name], ~np.isnan(self.columns[name])
        here = known if objects is None else known & (self.objects == objects)
        found = {c: values[here & (self.assistance == c)] for c in self.conditions()}
        return {c: v for c, v in found.items() if len(v)}

    def visits(self) -> NDArray[np.int64]:
        """Visits of each person, (n,); without a column `visits`, two per object if all were delivered."""
        told = zip(self.rows, (2 * self.objects).tolist(), strict=True)
        whole = [
            (row.get("visits"), usual * (row.get("ended", ALL_DELIVERED) == ALL_DELIVERED))
            for row, usual in told
        ]
        return np.array([usual if made is None else made for made, usual in whole])

    def numbers(self, name: str) -> NDArray[np.float64]:
        """A further column of numbers, (n,); NaN where it is not known."""
        told = (row.get(name) for row in self.rows)
        return np.array([np.nan if value is None else value for value in told], float)

    def densities(self) -> NDArray[np.float64]:
        """Objects per square metre of the floor, (n,); NaN where the area is not known."""
        return np.asarray(self.objects / self.numbers("area_m2"))

    def absent(self) -> list[str]:
        """A line that names those who are left out, if any."""
        names = [person.person for person in self.left_out]
        more = f" and {len(names) - SHOWN} more" if len(names) > SHOWN else ""
        return (
            [f"left out, as not everything was delivered: {', '.join(names[:SHOWN])}{more}"] if names else []
        )

    def sizes(self) -> dict[tuple[str, int], int]:
        """People by condition and number of objects, empty cells included."""
        count = Counter(zip(self.assistance.tolist(), self.objects.tolist(), strict=True))
        return {(c, n): count[(c, n)] for c in self.conditions() for n in self.levels()}


def read_study(folder: Path, measures: Measures) -> StudyTable:
    """The people of a study, a batch or `mjsim play` who finished; a RecordError names what is missing or invalid."""
    return study_table(read_people(folder), measures, people_path(folder))


def people_path(folder: Path) -> Path:
    """The table of a study or a batch; `mjsim play` has none, but a folder of visits."""
    return folder if visit_folders(folder) else folder / f"{NAME}.parquet"


def read_people(folder: Path) -> Sequence[Mapping[str, Any]]:
    """The rows of a study, a batch or `mjsim play`; a RecordError names a missing column."""
    if visits := visit_folders(folder):
        return [{"participant": str(visit.relative_to(folder)), **_visitor(visit)} for visit in visits]
    path = people_path(folder)
    rows = read_rows(path)
    if not rows:
        raise RecordError(f"{path} has no rows; there are no participants yet")
    missing = [name for name in REQUIRED if name not in rows[0]]
    if missing:
        raise RecordError(f"{path} has no column {', '.join(missing)}; it is not a table of people")
    return rows


def _visitor(visit: Path) -> Mapping[str, Any]:
    """What the record of a task says, or what the task is where it is not over."""
    if is_run(visit / TASK):
        return read_trial(visit / TASK).row
    stored = read_json(visit / VISIT)
    try:
        return {name: stored["trials"][TASK][name] for name in REQUIRED} | {"ended": "not over"}
    except (KeyError, TypeError) as error:
        raise RecordError(f"{visit / VISIT} names no task") from error


def study_table(
    everybody: Sequence[Mapping[str, Any]],
    measures: Measures,
    path: Path,
    exclusions: Exclusions = Exclusions(),  # noqa: B008 - frozen
) -> StudyTable:
    """People by their rows, but for those who are left out; a RecordError names `path` and a value that is invalid."""
    _check_design(everybody, path)
    _check_answer_columns(present_columns(everybody), measures, path)
    absent = left_out(exclusions, everybody, path)
    kept = {k: row for k, row in enumerate(everybody) if k not in absent}
    rows = list(kept.values())
    if not rows:
        rules = Counter(rule for person in absent.values() for rule in person.rules)
        each = ", ".join(f"{count} by {rule}" for rule, count in rules.items())
        raise RecordError(f"{path}: all {counted(len(absent), 'row')} are left out: {each}")
    present = present_columns(rows)
    read = {column: _numbers(kept, column, path) for column in _candidates(measures) if column in present}
    numbers = {column: np.where(np.isinf(values), np.nan, values) for column, values in read.items()}
    known = {column for column, values in numbers.items() if not np.isnan(values).all()}
    sources = {}
    for name, measure in measures.objective.items():
        if (column := resolve(measure, known)) is not None:
            sources[name] = column
        sources |= {other: other for other in measure.others if other in known}
    sources |= {name: name for name in _likert_columns(measures) if name in known}
    if not sources:
        wanted = ", ".join(m.column for m in measures.objective.values())
        raise RecordError(f"{path} has none of the measures {wanted}")
    columns = {name: numbers[column] for name, column in sources.items()}
    origin = origin_of(row["user"] for row in rows)
    answers = [name for name in columns if name.startswith(LIKERT_PREFIX)]
    if origin not in (RECORDED, REHEARSED) and answers:
        raise RecordError(f"{path} has answers of simulated people ({answers[0]}); nothing simulates answers")
    _check_ranges(kept, numbers, measures, path)
    for name in answers:
        _check_answers(columns[name], name, path)
    return StudyTable(
        rows,
        np.array([str(row["assistance"]) for row in rows]),
        np.array([row["objects"] for row in rows]),
        np.array([f"{row.get('house')}/{row.get('house_seed')}" for row in rows]),
        np.array([_person(row, k) for k, row in kept.items()]),
        columns,
        sources,
        origin,
        tuple(_notes(rows, measures)),
        tuple(absent.values()),
        tuple(_gaps(kept, read, sources)),
    )


def _check_design(rows: Sequence[Mapping[str, Any]], path: Path) -> None:
    for k, row in enumerate(rows):
        if not isinstance(row["assistance"], str) or not row["assistance"]:
            raise RecordError(f"{path}: row {k} has the assistance {row['assistance']!r}, not a name")
        if not isinstance(row["objects"], int) or isinstance(row["objects"], bool) or row["objects"] < 1:
            raise RecordError(f"{path}: row {k} has {row['objects']!r} objects, not a whole number from 1 on")


def _check_answer_columns(columns: Sequence[str], measures: Measures, path: Path) -> None:
    known = _likert_columns(measures)
    for name in columns:
        if name.lower().startswith(LIKERT_PREFIX.rstrip("_")) and name not in known:
            near = difflib.get_close_matches(name, known, 1, cutoff=0.0)[0]
            raise RecordError(
                f"{path} has answers {name!r}, which is no item of the survey (the nearest is {near}); rename or drop "
                f"the column, or add the item under [likert] to a copy of {FILE}, for --measures"
            )


def _check_ranges(
    rows: Mapping[int, Mapping[str, Any]],
    numbers: Mapping[str, NDArray[np.float64]],
    measures: Measures,
    path: Path,
) -> None:
    for measure in measures.objective.values():
        low, high = measure.range
        for name in (measure.column, *filter(None, [measure.without]), *measure.others):
            values = numbers.get(name, np.empty(0))
            for place in np.flatnonzero((values < low) | (values > high)).tolist():
                k = list(rows)[place]
                raise RecordError(
                    f"{path}: row {k} (person seed {rows[k].get('person_seed')}) has the {name} {values[place]:g}, "
                    f"not a number from {low:g} to {high:g}; correct it, or leave the person out by --exclude"
                )


def _likert_columns(measures: Measures) -> list[str]:
    return [LIKERT_PREFIX + name for name in measures.likert]


def _candidates(measures: Measures) -> list[str]:
    objective = [
        c for m in measures.objective.values() for c in (m.column, m.without, *m.others) if c is not None
    ]
    return [*objective, *_likert_columns(measures)]


def _numbers(rows: Mapping[int, Mapping[str, Any]], column: str, path: Path) -> NDArray[np.float64]:
    """A column (n,), with NaN for unknown values."""
    for k, row in rows.items():
        value = row.get(column)
        if value is not None and (isinstance(value, str | bool) or not isinstance(value, int | float)):
            raise RecordError(f"{path}: row {k} has the {column} {value!r}, which is no number")
    return np.array([np.nan if row.get(column) is None else row[column] for row in rows.values()], float)


def _check_answers(values: NDArray[np.float64], name: str, path: Path) -> None:
    given = values[~np.isnan(values)]
    bad = given[(given != np.round(given)) | (given < ANSWERS[0]) | (given > ANSWERS[1])]
    if len(bad):
        raise RecordError(f"{path}: {name} has the answer {bad[0]:g}; answers are whole numbers from 1 to 5")


def _gaps(
    rows: Mapping[int, Mapping[str, Any]], read: Mapping[str, NDArray[np.float64]], sources: Mapping[str, str]
) -> Iterator[Gap]:
    """Who lacks a measure; a column that is infinite for everybody else is named as well, though it is not analysed."""
    names = {column: name for name, column in sources.items()}
    everybody = [person_name(row, k) for k, row in rows.items()]
    for column, values in read.items():
        for value, lacking in (("infinite", np.isinf(values)), ("missing", np.isnan(values))):
            if lacking.any() and (column in names or np.isinf(values).any()):
                people = tuple(everybody[k] for k in np.flatnonzero(lacking))
                yield Gap(names.get(column, column), value, people)


def _notes(rows: Sequence[Mapping[str, Any]], measures: Measures) -> list[str]:
    notes = unread_note(present_columns(rows), measures)
    unfinished = sum(row.get("ended", ALL_DELIVERED) != ALL_DELIVERED for row in rows)
    if unfinished:
        notes.append(
            f"{counted(unfinished, 'trial')} ended before everything was delivered; times and distances of these are "
            "smaller than those of the whole task."
        )
    cells = Counter(
        cell for _, cell in {_person_and_cell(row) for row in rows if row.get("person_seed") is not None}
    )
    people = {
        person for person, _ in {_person_and_cell(row) for row in rows if row.get("person_seed") is not None}
    }
    if sum(cells.values()) > len(people):
        notes.append(
            "The same people are in several cells. These tests treat them as different people, which costs power; "
            "`mjsim compare` pairs them."
        )
    trials = Counter((_person(row, k), row["assistance"], row["objects"]) for k, row in enumerate(rows))
    if len(trials) < len(rows):
        notes.append(
            "People have several trials in a cell. Only the mixed models and the intervals by house know that; all "
            "other tests and intervals take each trial for another person, and are too sure."
        )
    if confounded := confounded_rows(rows):
        notes.append(confounded[0].upper() + confounded[1:] + ".")
    return notes


def _person(row: Mapping[str, Any], number: int) -> str:
    """Who a row is about; a row that does not say it is somebody else."""
    told = row.get("participant"), row.get("person_seed")
    return f"{row['user']}/{next((name for name in told if name is not None), f'row {number}')}"


def _person_and_cell(row: Mapping[str, Any]) -> tuple[Any, Any]:
    return (row["user"], row.get("participant"), *(row.get(s) for s in SEEDS if s != "house_seed")), (
        row["assistance"],
        row["objects"],
    )
