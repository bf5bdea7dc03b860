"""Compare the results of a study with and without each of its exclusion rules."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import msgspec

from experiments.analysis.page import Block, Paragraph, TableBlock, p_value, table
from experiments.analysis.statistics.effects import ALPHA
from experiments.analysis.study.analysis import ONE_WAY, TWO_WAY, Test, plain, test_results, tests_of
from experiments.analysis.study.measures import LIKERT_PREFIX, Measures
from experiments.analysis.study.table import StudyTable, study_table
from experiments.errors import RecordError
from experiments.trials.exclusions import BY_NAME, UNFINISHED, Exclusions, LeftOut

SHOWN_TESTS = "the main tests, and all others whose decisions change; stats.json holds every test."
MAIN = (ONE_WAY, TWO_WAY, "ordinal", "mixed model")
CHANGE_HEAD = (
    *("measure", "test", "effect", "objects", "F or χ²", "without", "p", "without"),
    *("partial η²", "without", "decision"),
)
Key = tuple[str, str, str, int | None]  # measure, test, effect, and number of objects (None for all)


@dataclass(frozen=True)
class Change:
    """The results of a test with and without an exclusion rule, or None if they cannot be computed."""

    measure: str
    test: str
    effect: str
    objects: int | None
    all_rules: Mapping[str, Any] | None
    without: Mapping[str, Any] | None
    decision_changes: bool


@dataclass(frozen=True)
class LeaveOneOut:
    """The effect of one exclusion rule on the results.

    Attributes:
        alone: Number of participants who are excluded by this rule and by no other.
        changes: Results of every test with and without the rule. Empty if `alone` is 0.
        refused: Reason why the results without the rule cannot be computed, or None.
    """

    rule: str
    reason: str
    leaves_out: int
    alone: int
    changes: tuple[Change, ...]
    refused: str | None = None


def leave_one_out(
    people: Sequence[Mapping[str, Any]], measures: Measures, path: Path, exclusions: Exclusions
) -> list[LeaveOneOut]:
    """Compare the test results with and without each exclusion rule. Exclusions by ID count as one rule."""
    found = []
    whole = study_table(people, measures, path, exclusions)
    tests = _tests(whole, measures)
    for rule, reason, rest in _without_each(exclusions):
        theirs = [person for person in whole.left_out if rule in person.rules]
        alone = sum(len(person.rules) == 1 for person in theirs)
        changes: tuple[Change, ...] = ()
        refused = None
        try:
            others = _tests(study_table(people, measures, path, rest), measures) if alone else {}
            changes = tuple(
                _change(key, tests.get(key), others.get(key)) for key in {**tests, **others} if alone
            )
        except RecordError as error:  # the rule excludes a row with invalid values
            refused = str(error)
        found.append(LeaveOneOut(rule, reason, len(theirs), alone, changes, refused))
    return found


def _without_each(exclusions: Exclusions) -> Iterator[tuple[str, str, Exclusions]]:
    for rule in exclusions.all_rules():
        rest = tuple(other for other in exclusions.rules if other != rule)
        kept = "keep" if str(rule) == str(UNFINISHED) else exclusions.unfinished
        yield str(rule), rule.reason, msgspec.structs.replace(exclusions, rules=rest, unfinished=kept)
    if exclusions.people:
        reasons = "; ".join(dict.fromkeys(person.reason for person in exclusions.people))
        yield BY_NAME, reasons, msgspec.structs.replace(exclusions, people=())


def _tests(people: StudyTable, measures: Measures) -> dict[Key, Test]:
    return {
        (result.measure, result.kind, effect, result.objects): test
        for result in test_results(people, measures)
        for effect, test in tests_of(result)
    }


def _change(key: Key, one: Test | None, other: Test | None) -> Change:
    decisions = [test is not None and test.p < ALPHA for test in (one, other)]
    whole, without = (None if test is None else plain(test) for test in (one, other))
    return Change(*key, whole, without, decisions[0] != decisions[1])


@dataclass(frozen=True)
class Selection:
    """The exclusions of a study, and its departures from the preregistration with the given SHA-256."""

    rules: Sequence[LeaveOneOut]
    preregistration: str | None = None
    departures: Sequence[str] = ()

    def as_json(self) -> dict[str, Any]:
        frozen = {"sha256": self.preregistration, "departures": list(self.departures)}
        return {
            "exclusions": [asdict(rule) for rule in self.rules],
            "preregistration": None if self.preregistration is None else frozen,
        }

    def sections(self, people: StudyTable) -> tuple[tuple[str, Iterable[Block]], ...]:
        preregistered = (
            (("Preregistration", _preregistered(self)),) if self.preregistration is not None else ()
        )
        return (*preregistered, ("People who are left out", _left_out(people, self.rules)))


def _preregistered(selection: Selection) -> Iterator[Block]:
    yield Paragraph(f"SHA-256 of the preregistration: {selection.preregistration}.")
    yield Paragraph("Departures:" if selection.departures else "There are no departures.")
    yield from map(Paragraph, selection.departures)


def left_out_table(people: Iterable[LeftOut]) -> TableBlock:
    return table(
        ("left out", "condition", "objects", "by", "reason"),
        [
            (p.person, p.assistance, p.objects, "; ".join(p.rules), "; ".join(p.rules.values()))
            for p in people
        ],
    )


def _left_out(people: StudyTable, found: Sequence[LeaveOneOut]) -> Iterator[Block]:
    main = [
        name for name, column in people.sources.items() if name != column or name.startswith(LIKERT_PREFIX)
    ]
    yield left_out_table(people.left_out)
    yield table(
        ("left out of one measure", "value", "people", "who"),
        [(gap.measure, gap.value, len(gap.people), ", ".join(gap.people)) for gap in people.gaps],
    )
    if not people.left_out and not people.gaps:
        yield Paragraph("No one.")
    yield table(
        ("rule", "reason", "leaves out", "by it alone", "decisions at .05 that change without it"),
        [
            (
                one.rule,
                one.reason,
                one.leaves_out,
                one.alone,
                f"{sum(c.decision_changes for c in one.changes)} of {len(one.changes)}",
            )
            for one in found
        ],
    )
    for one in found:
        if one.changes or one.refused:
            yield Paragraph(f"Without {one.rule}: {one.refused or SHOWN_TESTS}")
        yield table(
            CHANGE_HEAD,
            [
                _change_row(c)
                for c in one.changes
                if c.decision_changes or (c.measure in main and c.test in MAIN)
            ],
        )


def _change_row(change: Change) -> tuple[object, ...]:
    pair = [test or {} for test in (change.all_rules, change.without)]
    return (
        *(change.measure, change.test, change.effect, change.objects),
        *(test.get("statistic") for test in pair),
        *(p_value(test.get("p")) for test in pair),
        *(test.get("eta_squared") for test in pair),
        "changes" if change.decision_changes else "the same",
    )
