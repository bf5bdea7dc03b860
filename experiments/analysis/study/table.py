"""Read the table of a study's participants from `trials.parquet` or from the output of `mjsim play`."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.analysis.study.measures import (
    LIKERT_PREFIX,
    Measures,
    check_answer_columns,
    check_answers,
    check_ranges,
    present_columns,
    resolve,
    unread_note,
)
from experiments.errors import RecordError, listed
from experiments.record.files import read_json
from experiments.record.phases import ALL_DELIVERED, RECORDED, REHEARSED, TASK, origin_of
from experiments.record.run_directory import VISIT, is_run, visit_folders
from experiments.trials.batch_folder import read_trial
from experiments.trials.design import confounded_rows, counted
from experiments.trials.exclusions import Exclusions, LeftOut, inapplicable, left_out, person_name
from experiments.trials.table import NAME, read_rows
from experiments.trials.trial_config import SEEDS

ANALYSIS = "analysis"  # default name of the output folder of an analysis
REPORT, STATISTICS, PEOPLE, TESTS = "report.html", "stats.json", "people", "tests.csv"
FILES = (REPORT, STATISTICS, f"{PEOPLE}.parquet", f"{PEOPLE}.csv", TESTS)  # output files of an analysis
REQUIRED = ("assistance", "objects", "user")
CONDITIONS = ("none", "highlight", "optimal")  # conditions of the paper, in the same order
MAX_PEOPLE_SHOWN = 20  # maximum number of participants that are listed in a message


@dataclass(frozen=True)
class Gap:
    """Participants who are excluded from the tests of a measure because of missing or infinite values."""

    measure: str
    value: str
    people: tuple[str, ...]


@dataclass(frozen=True)
class StudyTable:
    """The participants of a study, in the order of the table rows. All arrays have shape (n,).

    Attributes:
        houses: Name of the house in each trial.
        people: Identifier of the participant, which is the same in all of their trials.
        columns: Values of measures and answers by short name, with NaN for unknown values.
        sources: Name of each column in the table file, by short name.
        origin: `Simulated`, `Partly simulated` or `Recorded from people`.
        notes: Remarks about the table, one sentence each.
        left_out: Participants excluded from the table.
    """

    rows: Sequence[Mapping[str, Any]]
    assistance: NDArray[Any]
    objects: NDArray[np.int64]
    houses: NDArray[Any]
    people: NDArray[Any]
    columns: Mapping[str, NDArray[np.float64]]
    sources: Mapping[str, str]
    origin: str
    notes: tuple[str, ...]
    left_out: tuple[LeftOut, ...]
    gaps: tuple[Gap, ...]

    def conditions(self) -> list[str]:
        present = dict.fromkeys(self.assistance.tolist())
        return [c for c in CONDITIONS if c in present] + [c for c in present if c not in CONDITIONS]

    def levels(self) -> list[int]:
        return sorted(set(self.objects.tolist()))

    def take(self, people: NDArray[np.int64]) -> "StudyTable":
        """Return a table of the rows with the given indices, shape (m,). Indices may be repeated."""
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
        """Return the known values of a measure by condition, for one number of objects or for all."""
        values, known = self.columns[name], ~np.isnan(self.columns[name])
        here = known if objects is None else known & (self.objects == objects)
        found = {c: values[here & (self.assistance == c)] for c in self.conditions()}
        return {c: v for c, v in found.items() if len(v)}

    def visits(self) -> NDArray[np.int64]:
        """Return the number of visits per trial. Where it is not recorded, it follows from the number of objects."""
        found = []
        for row, usual in zip(self.rows, (2 * self.objects).tolist(), strict=True):
            made, finished = row.get("visits"), row.get("ended", ALL_DELIVERED) == ALL_DELIVERED
            found.append(usual * finished if made is None else made)
        return np.array(found)

    def numbers(self, name: str) -> NDArray[np.float64]:
        """Return a numeric column as an array, with NaN for unknown values."""
        values = (row.get(name) for row in self.rows)
        return np.array([np.nan if value is None else value for value in values], float)

    def densities(self) -> NDArray[np.float64]:
        """Return the number of objects per square metre of floor, or NaN if the area is unknown."""
        return np.asarray(self.objects / self.numbers("area_m2"))

    def absent(self) -> list[str]:
        """Return a list with one note that names all excluded participants, or an empty list."""
        names = [person.person for person in self.left_out]
        if not names:
            return []
        return [f"left out, as not everything was delivered: {listed(names, MAX_PEOPLE_SHOWN)}"]

    def sizes(self) -> dict[tuple[str, int], int]:
        """Return the number of participants for each combination of condition and number of objects."""
        count = Counter(zip(self.assistance.tolist(), self.objects.tolist(), strict=True))
        return {(c, n): count[(c, n)] for c in self.conditions() for n in self.levels()}


def read_study(folder: Path, measures: Measures) -> StudyTable:
    """Read a study, a batch or the output of `mjsim play`. Return a table of the finished participants."""
    return study_table(read_people(folder), measures, people_path(folder))


def people_path(folder: Path) -> Path:
    """Return the path of the table in a study or batch folder, or `folder` itself if it contains visits."""
    return folder if visit_folders(folder) else folder / f"{NAME}.parquet"


def read_people(folder: Path) -> Sequence[Mapping[str, Any]]:
    """Read all rows from a study, a batch or `mjsim play`. Raises `RecordError` if a column is missing."""
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
    if is_run(visit / TASK):
        return read_trial(visit / TASK).row
    stored = read_json(visit / VISIT)
    try:
        return {name: stored["trials"][TASK][name] for name in REQUIRED} | {"ended": "not over"}
    except (KeyError, TypeError) as error:
        raise RecordError(f"{visit / VISIT} has no task") from error


def study_table(
    people: Sequence[Mapping[str, Any]],
    measures: Measures,
    path: Path,
    exclusions: Exclusions = Exclusions(),  # noqa: B008 - frozen
) -> StudyTable:
    """Build the study table of all participants who are not excluded. `path` is used only in messages."""
    _check_design(people, path)
    check_answer_columns(present_columns(people), measures, path)
    absent = left_out(exclusions, people, path)
    kept = {k: row for k, row in enumerate(people) if k not in absent}
    rows = list(kept.values())
    if not rows:
        rules = Counter(rule for person in absent.values() for rule in person.rules)
        each = ", ".join(f"{count} by {rule}" for rule, count in rules.items())
        raise RecordError(f"{path}: all {counted(len(absent), 'row')} are left out: {each}")
    present = present_columns(rows)
    candidates = [*(c for m in measures.objective.values() for c in m.columns), *measures.answers()]
    read = {column: _numbers(kept, column, path) for column in candidates if column in present}
    numbers = {column: np.where(np.isinf(values), np.nan, values) for column, values in read.items()}
    known = {column for column, values in numbers.items() if not np.isnan(values).all()}
    sources = {}
    for name, measure in measures.objective.items():
        if (column := resolve(measure, known)) is not None:
            sources[name] = column
        sources |= {other: other for other in measure.others if other in known}
    sources |= {name: name for name in measures.answers() if name in known}
    if not sources:
        wanted = ", ".join(m.column for m in measures.objective.values())
        raise RecordError(f"{path} has none of the measures {wanted}")
    columns = {name: numbers[column] for name, column in sources.items()}
    origin = origin_of(row["user"] for row in rows)
    answers = [name for name in columns if name.startswith(LIKERT_PREFIX)]
    if origin not in (RECORDED, REHEARSED) and answers:
        raise RecordError(
            f"{path} has answers of simulated people ({answers[0]}), but answers are never simulated"
        )
    check_ranges(kept, numbers, measures, path)
    for name in answers:
        check_answers(columns[name], name, measures.points, path)
    return StudyTable(
        rows,
        np.array([str(row["assistance"]) for row in rows]),
        np.array([row["objects"] for row in rows]),
        np.array([f"{row.get('house')}/{row.get('house_seed')}" for row in rows]),
        np.array([_person(row, k) for k, row in kept.items()]),
        columns,
        sources,
        origin,
        (*_notes(rows, measures), *_inapplicable(exclusions, people)),
        tuple(absent.values()),
        tuple(_gaps(kept, read, sources)),
    )


def _check_design(rows: Sequence[Mapping[str, Any]], path: Path) -> None:
    for k, row in enumerate(rows):
        if not isinstance(row["assistance"], str) or not row["assistance"]:
            raise RecordError(f"{path}: row {k} has the assistance {row['assistance']!r}, not a name")
        if not isinstance(row["objects"], int) or isinstance(row["objects"], bool) or row["objects"] < 1:
            raise RecordError(
                f"{path}: row {k} has {row['objects']!r} objects, not a whole number of at least 1"
            )


def _numbers(rows: Mapping[int, Mapping[str, Any]], column: str, path: Path) -> NDArray[np.float64]:
    for k, row in rows.items():
        value = row.get(column)
        if value is not None and (isinstance(value, str | bool) or not isinstance(value, int | float)):
            raise RecordError(f"{path}: row {k} has the {column} {value!r}, which is not a number")
    return np.array([np.nan if row.get(column) is None else row[column] for row in rows.values()], float)


def _gaps(
    rows: Mapping[int, Mapping[str, Any]], read: Mapping[str, NDArray[np.float64]], sources: Mapping[str, str]
) -> Iterator[Gap]:
    names = {column: name for name, column in sources.items()}
    everyone = [person_name(row, k) for k, row in rows.items()]
    for column, values in read.items():
        for value, lacking in (("infinite", np.isinf(values)), ("missing", np.isnan(values))):
            if lacking.any() and (column in names or np.isinf(values).any()):
                people = tuple(everyone[k] for k in np.flatnonzero(lacking))
                yield Gap(names.get(column, column), value, people)


def _notes(rows: Sequence[Mapping[str, Any]], measures: Measures) -> list[str]:
    notes = unread_note(present_columns(rows), measures)
    unfinished = sum(row.get("ended", ALL_DELIVERED) != ALL_DELIVERED for row in rows)
    if unfinished:
        notes.append(
            f"{counted(unfinished, 'trial')} ended before everything was delivered; times and distances of these are "
            "smaller than those of the whole task."
        )
    pairs = {_person_and_cell(row) for row in rows if row.get("person_seed") is not None}
    if len(pairs) > len({person for person, _ in pairs}):
        notes.append(
            "The same people are in several cells. These tests treat them as different people, which costs power; "
            "`mjsim compare` pairs them."
        )
    trials = Counter((_person(row, k), row["assistance"], row["objects"]) for k, row in enumerate(rows))
    if len(trials) < len(rows):
        notes.append(
            "People have several trials in a cell. Only the mixed models and the intervals by house account for this. "
            "All other tests and intervals treat each trial as another person, so they are too narrow."
        )
    if confounded := confounded_rows(rows):
        notes.append(confounded[0].upper() + confounded[1:] + ".")
    return notes


def _inapplicable(exclusions: Exclusions, rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    for rule in inapplicable(exclusions, rows):
        yield f"The rule {rule} is not applied, because {rule.column} is only recorded from people."


def _person(row: Mapping[str, Any], number: int) -> str:
    """Return an identifier of the participant in a row, which is unique to the row if none is recorded."""
    names = row.get("participant"), row.get("person_seed")
    return f"{row['user']}/{next((name for name in names if name is not None), f'row {number}')}"


def _person_and_cell(row: Mapping[str, Any]) -> tuple[Any, Any]:
    return (row["user"], row.get("participant"), *(row.get(s) for s in SEEDS if s != "house_seed")), (
        row["assistance"],
        row["objects"],
    )
