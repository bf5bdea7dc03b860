"""A study scored against the published one, row by row.

A study of the usual size is judged by its own tests. A pool of many people in every cell is judged as a population: by
its effect sizes at the published numbers of people, and by how many of 200 studies that are drawn from it come out as
published.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from experiments.analysis.page import p_value
from experiments.analysis.statistics.effects import ALPHA, FTest
from experiments.analysis.statistics.noncentral import Interval
from experiments.errors import StatisticsError
from experiments.record.origin import RECORDED
from experiments.study.measures import LIKERT_PREFIX
from experiments.study.table import StudyTable
from studies.published import Direction, Published, PublishedTest
from studies.score_population import population_eta_squared
from studies.score_rules import (
    points,
    published_cells,
    require_cells,
    tests_of,
    varies_most,
)

POOL = 200  # people in each cell that make a pool
REPLICATES = 200  # studies drawn from it
EFFECT_SIZE, INFERENCE, DIRECTION, VARIANCE = "effect size", "inference", "direction", "variance order"
NOT_SIMULATED = "not simulated"

Rule = Callable[[StudyTable], bool]


@dataclass(frozen=True)
class Row:
    """One published result and ours.

    Attributes:
        kind: `effect size`, `inference`, `direction` or `variance order`.
        measure: Short name of the measure.
        what: What is stated of it.
        objects: At which number of objects; None over all.
        held_out: Whether nothing may be fitted to it.
        published: As printed.
        target: Effect sizes that go with it, or None.
        ours: What was found, in words.
        agrees: Whether that is the same; None where it cannot be said.
        rate: Share of the studies drawn from a pool in which it is the same; None without a pool.
        remark: Why nothing can be said, or what is inconsistent in the published numbers; or None.
    """

    kind: str
    measure: str
    what: str
    objects: int | None
    held_out: bool
    published: str
    target: Interval | None = None
    ours: str = ""
    agrees: bool | None = None
    rate: float | None = None
    remark: str | None = None


@dataclass(frozen=True)
class Score:
    """All rows.

    Attributes:
        origin: Whether people were simulated.
        people: How many of them are in cells of the published study.
        pool: Whether they are judged as a population.
        as_published: Whether every cell has as many people as in the published study.
        rows: The rows in the order of the published numbers.
    """

    origin: str
    people: int
    pool: bool
    as_published: bool
    rows: tuple[Row, ...]

    def summary(self) -> Iterator[tuple[str, str, int, int]]:
        """What, fitted or held out, how many agree, of how many; rows of which nothing can be said do not agree."""
        for name, kinds in (
            ("effect sizes and inferences", (EFFECT_SIZE, INFERENCE)),
            ("directions", (DIRECTION,)),
            ("variance orders", (VARIANCE,)),
        ):
            for held_out in (False, True):
                rows = [r for r in self.rows if r.kind in kinds and r.held_out == held_out]
                rows = [r for r in rows if r.ours != NOT_SIMULATED]
                yield (
                    name,
                    "held out" if held_out else "fitted",
                    sum(r.agrees is True for r in rows),
                    len(rows),
                )


def score(table: StudyTable, published: Published, *, seed: int = 0) -> Score:
    """Judge a study.

    Args:
        table: Its people; those in other cells than the published ones are left out.
        published: The published numbers.
        seed: Of the studies that are drawn from a pool.

    Raises:
        StatisticsError: No cell of the published study has people.
    """
    inside = published_cells(table, published)
    sizes = published.people.sizes()
    if not inside.rows:
        conditions, numbers = (list(dict.fromkeys(cell[k] for cell in sizes)) for k in range(2))
        raise StatisticsError(
            f"no people in the cells of the published study: {conditions} with {numbers} objects"
        )
    known = Counter(zip(inside.assistance.tolist(), inside.objects.tolist(), strict=True))
    is_pool = all(known[cell] >= POOL for cell in sizes)
    judge = _Judge(inside, published, tuple(draw(inside, published, seed)) if is_pool else ())
    return Score(table.origin, len(inside.rows), is_pool, known == Counter(sizes), tuple(judge.rows()))


def draw(pool: StudyTable, published: Published, seed: int, count: int = REPLICATES) -> Iterator[StudyTable]:
    """Studies of the published size: people drawn from the same cell of a pool, with replacement."""
    rng = np.random.default_rng(seed)
    cells = [
        (np.flatnonzero((pool.assistance == condition) & (pool.objects == objects)), size)
        for (condition, objects), size in published.people.sizes().items()
    ]
    for _ in range(count):
        yield pool.take(np.concatenate([rng.choice(people, size) for people, size in cells]))


@dataclass(frozen=True)
class _Judge:
    """Judges a table, or a pool with the studies that were drawn from it."""

    table: StudyTable
    published: Published
    replicates: tuple[StudyTable, ...]
    known: dict[tuple[str, int | None], list[dict[str, FTest]]] = field(default_factory=dict)

    def rows(self) -> Iterator[Row]:
        for test in self.published.tests:
            yield from self._test_rows(test)
        for direction in self.published.directions:
            yield self._direction_row(direction)
        order = self.published.variances
        for objects in self.published.people.objects:
            row = Row(
                VARIANCE, order.measure, f"{order.largest} largest", objects, objects != 6, order.largest
            )
            rule = partial(varies_most, measure=order.measure, condition=order.largest, objects=objects)
            yield self._judged(row, rule)

    def _test_rows(self, test: PublishedTest) -> Iterator[Row]:
        people = self.published.people_of(test.objects)
        printed = f"F({test.df[0]},{test.df[1]}) " + (
            "n.s."
            if test.statistic is None
            else f"= {test.statistic:g}" + (f", p {test.p}" if test.p else "")
        )
        row = Row(
            EFFECT_SIZE,
            test.measure,
            test.effect,
            test.objects,
            test.held_out,
            printed,
            test.interval(people),
            remark=test.inconsistency(),
        )
        if self._is_not_simulated(test.measure):
            yield replace(row, ours=NOT_SIMULATED)
            yield replace(row, kind=INFERENCE, ours=NOT_SIMULATED)
            return
        try:
            require_cells(self.table, self.published, test.measure, test.objects)
            found = tests_of(self.table, test.measure, test.objects)[test.effect]
            yield self._effect_size(row, test, found)
            yield self._inference(replace(row, kind=INFERENCE), test, found)
        except StatisticsError as error:
            yield replace(row, remark=str(error))
            yield replace(row, kind=INFERENCE, remark=str(error))

    def _is_not_simulated(self, measure: str) -> bool:
        return measure.startswith(LIKERT_PREFIX) and self.table.origin != RECORDED

    def _effect_size(self, row: Row, test: PublishedTest, found: FTest) -> Row:
        low, high = row.target or (0.0, 1.0)
        size, ours = found.eta_squared, f"{found.eta_squared:.3f}"
        if self.replicates:
            size = population_eta_squared(self.table, self.published, test)
            ours = f"{size:.3f} in the population"
        rate = self._rate([low <= one.eta_squared <= high for one in self._drawn(test)])
        return replace(row, ours=ours, agrees=low <= size <= high, rate=rate)

    def _inference(self, row: Row, test: PublishedTest, found: FTest) -> Row:
        drawn = [one.p < ALPHA for one in self._drawn(test)]
        rate = self._rate([one == test.significant for one in drawn])
        if rate is None:
            ours = f"F({found.df1},{found.df2:g}) = {found.statistic:.2f}, p {p_value(found.p)}"
            return replace(row, ours=ours, agrees=(found.p < ALPHA) == test.significant)
        ours = f"p < .05 in {sum(drawn) / len(self.replicates):.0%}"
        return replace(row, ours=ours, agrees=rate > 0.5, rate=rate)

    def _drawn(self, test: PublishedTest) -> list[FTest]:
        """The test in the studies of a pool, where it can be computed; all tests of a measure are worked out once."""
        key = test.measure, test.objects
        if key not in self.known:
            self.known[key] = [found for t in self.replicates if (found := _tests(t, *key)) is not None]
        return [found[test.effect] for found in self.known[key]]

    def _direction_row(self, direction: Direction) -> Row:
        held_out = direction.objects is None
        label = direction.label()
        printed = label if direction.p is None else f"{label}, p {direction.p}"
        row = Row(DIRECTION, direction.measure, label, direction.objects, held_out, printed)
        if self._is_not_simulated(direction.measure):
            return replace(row, ours=NOT_SIMULATED)
        # A test's decision depends on how many people there are: studies of the published size decide.
        decided = direction.pair is not None or direction.same is not None
        return self._judged(row, partial(points, row=direction), by_rate=decided)

    def _judged(self, row: Row, rule: Rule, *, by_rate: bool = False) -> Row:
        try:
            require_cells(self.table, self.published, row.measure, row.objects)
            agrees = rule(self.table)
        except StatisticsError as error:
            return replace(row, remark=str(error))
        rate = self._rate([_holds(rule, study) for study in self.replicates])
        if by_rate and rate is not None:
            agrees = rate > 0.5
        return replace(row, ours="the same" if agrees else "not so", agrees=agrees, rate=rate)

    def _rate(self, agreeing: Sequence[bool]) -> float | None:
        """Share of the studies of a pool that agree; those of which nothing can be said do not. None without a pool."""
        return sum(agreeing) / len(self.replicates) if self.replicates else None


def _tests(study: StudyTable, measure: str, objects: int | None) -> dict[str, FTest] | None:
    try:
        return tests_of(study, measure, objects)
    except StatisticsError:
        return None


def _holds(rule: Rule, study: StudyTable) -> bool:
    try:
        return rule(study)
    except StatisticsError:
        return False


def inconsistencies(published: Published) -> Sequence[str]:
    """What is inconsistent in the published numbers, a line each."""
    return [
        f"{t.measure}, {t.effect}: {line}" for t in published.tests if (line := t.inconsistency()) is not None
    ]
