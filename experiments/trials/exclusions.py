"""Exclude participants from a study, by ID or by rules about the columns of its table (docs/analysis.md)."""

import difflib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from operator import eq, ge, gt, le, lt, ne
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec

from experiments.errors import RecordError
from experiments.record.phases import ALL_DELIVERED, is_simulated

Row = Mapping[str, Any]
Comparison = Literal["<", "<=", ">", ">=", "==", "!=", "missing", "infinite"]
Reason = Annotated[str, msgspec.Meta(min_length=1, max_length=200, pattern=r"^[^\r\n]*\S[^\r\n]*\Z")]
Name = Annotated[str, msgspec.Meta(max_length=200)]
# Columns that identify a participant, in order of reliability
IDS = ("participant", "fingerprint", "person_seed")
BY_NAME = "people by name"


class Rule(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A rule that excludes rows by a column's value. Missing values match only the comparison `missing`."""

    column: Name
    comparison: Comparison
    reason: Reason
    value: bool | int | float | Name | None = None

    def __post_init__(self) -> None:
        takes_value = self.comparison not in ("missing", "infinite")
        if takes_value != (self.value is not None):
            raise ValueError(f"{self.comparison!r} takes {'a' if takes_value else 'no'} `value`")
        if isinstance(self.value, float) and not math.isfinite(self.value):
            raise ValueError(
                f"`value` is {self.value}; write comparison = 'infinite' or 'missing' without a value instead"
            )
        if isinstance(self.value, str | bool) and self.comparison not in ("==", "!="):
            raise ValueError(f"{self.value!r} has no order; compare it by '==' or '!='")

    def __str__(self) -> str:
        given = "" if self.value is None else f" {self.value!r}"
        return f"{self.column} {self.comparison}{given}"

    def holds(self, row: Row) -> bool:
        """Return True if the rule excludes a row. Raises `TypeError` if the value cannot be compared."""
        found = row.get(self.column)
        unknown = found is None or (isinstance(found, float) and math.isnan(found))
        if unknown or self.comparison == "missing":
            return unknown and self.comparison == "missing"
        if self.comparison == "infinite":
            return isinstance(found, float) and math.isinf(found)
        if _kind(found) is not _kind(self.value):
            raise TypeError(f"{found!r} cannot be compared with {self.value!r}")
        return bool(_COMPARED[self.comparison](found, self.value))


_COMPARED: Mapping[str, Any] = {"<": lt, "<=": le, ">": gt, ">=": ge, "==": eq, "!=": ne}
UNFINISHED = Rule("ended", "!=", "did not deliver everything", ALL_DELIVERED)


class ExcludedPerson(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A participant who is excluded by ID, with the reason for the exclusion."""

    id: Name | int  # ID of the participant in one of the columns in `IDS`
    reason: Reason


class Exclusions(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The exclusions from a study. Unfinished participants are excluded unless `unfinished` is `keep`."""

    rules: tuple[Rule, ...] = ()
    people: tuple[ExcludedPerson, ...] = ()
    unfinished: Literal["leave out", "keep"] = "leave out"

    def __post_init__(self) -> None:
        rules, people = [str(rule) for rule in self.rules], [str(person.id) for person in self.people]
        for what, names in (("rule", rules), ("person", people)):
            if twice := next((name for name in names if names.count(name) > 1), None):
                raise ValueError(f"the {what} {twice} occurs twice; leave one out")

    def all_rules(self) -> tuple[Rule, ...]:
        """Return all rules, including the rule that excludes unfinished participants."""
        implied = self.unfinished == "leave out" and str(UNFINISHED) not in map(str, self.rules)
        return (*self.rules, *([UNFINISHED] if implied else []))


@dataclass(frozen=True)
class LeftOut:
    """An excluded participant, with the reasons for the exclusion."""

    person: str
    assistance: str
    objects: int
    rules: Mapping[str, str]


def left_out(exclusions: Exclusions, rows: Sequence[Row], path: Path) -> dict[int, LeftOut]:
    """Return the participants in a table who are excluded, by row number.

    Every rule must name a column of the table, and every excluded ID must occur in the table.
    """
    found: dict[int, dict[str, str]] = {}
    skipped = inapplicable(exclusions, rows)
    for number, rule in enumerate(exclusions.all_rules(), start=1):
        if rule in skipped or (rule is UNFINISHED and not any(rule.column in row for row in rows)):
            continue
        label = f"rule {number} ({rule})"
        _check_column(rule.column, rows, f"{path}: {label}")
        for k, row in enumerate(rows):
            try:
                holds = rule.holds(row)
            except TypeError as error:
                raise RecordError(f"{path}: {label} does not fit {person_name(row, k)}: {error}") from error
            if holds:
                found.setdefault(k, {})[str(rule)] = rule.reason
    for person in exclusions.people:
        by_column = (
            [k for k, row in enumerate(rows) if str(row.get(name)) == str(person.id)] for name in IDS
        )
        theirs = next(filter(None, by_column), None)
        if theirs is None:
            raise RecordError(
                f"{path}: no person {person.id!r} to leave out; ids are in {', '.join(IDS)}, such as "
                f"{person_name(rows[0], 0)!r}"
            )
        for k in theirs:
            found.setdefault(k, {})[BY_NAME] = person.reason
    return {
        k: LeftOut(person_name(rows[k], k), rows[k]["assistance"], rows[k]["objects"], found[k])
        for k in sorted(found)
    }


def inapplicable(exclusions: Exclusions, rows: Sequence[Row]) -> tuple[Rule, ...]:
    """Return rules whose columns simulated participants do not have. If any row is from a person, return no rules."""
    from experiments.record.metrics import Displays  # imported here so that commands start fast

    from_people = {"inattentive", "recruitment_known", *(field.name for field in fields(Displays))}
    simulated = all(is_simulated(row.get("user")) for row in rows)
    return tuple(
        rule
        for rule in exclusions.rules
        if simulated and rule.column in from_people and not any(rule.column in row for row in rows)
    )


def person_name(row: Row, number: int) -> str:
    """Return the ID of a participant, or the row number if the participant has no ID."""
    return str(next((row[name] for name in IDS if row.get(name) is not None), f"row {number}"))


def _kind(value: object) -> type:
    if isinstance(value, bool | str):
        return type(value)
    return float if isinstance(value, int | float) else type(value)


def _check_column(column: str, rows: Sequence[Row], where: str) -> None:
    known = list(dict.fromkeys(name for row in rows for name in row))
    if column not in known:
        near = difflib.get_close_matches(column, known, 1)
        advice = f"did you mean {near[0]}?" if near else "docs/data.md lists them"
        raise RecordError(f"{where}: the table has no column {column!r}; {advice}")
