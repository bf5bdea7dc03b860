"""Compare a study with the published one, result by result.

A study of ordinary size is judged by its own tests. A pool, which has many participants in every cell, is
judged as a population: by its effect sizes at the published numbers of participants, and by the share of 200
random studies from the pool that reproduce a result.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from experiments.analysis.page import p_text
from experiments.analysis.statistics.effects import ALPHA, FTest, Interval
from experiments.analysis.study.measures import LIKERT_PREFIX
from experiments.analysis.study.table import StudyTable
from experiments.errors import StatisticsError
from experiments.record.phases import RECORDED
from experiments.trials.exclusions import LeftOut
from studies.prediction import effect_found, log_score, population_interval, prediction_interval
from studies.published import Direction, Published, PublishedTest
from studies.score_population import draw, population_eta_squared
from studies.score_rules import points, published_cells, require_cells, tests_of, varies_most
from studies.truth import true_studies

POOL = 200  # smallest number of participants per cell in a pool
TRUTHS = 100  # number of random studies from a population that has the published effects
SCORED = 20  # number of these studies whose log scores are computed, which takes long
EFFECT_SIZE, INFERENCE, DIRECTION, VARIANCE = "effect size", "inference", "direction", "variance order"
NOT_SIMULATED = "not simulated"

Rule = Callable[[StudyTable], bool]


@dataclass(frozen=True)
class Row:
    """A published result and the corresponding result of the study.

    Attributes:
        kind: `effect size`, `inference`, `direction` or `variance order`.
        measure: Short name of the measure.
        what: Name of the tested effect or order.
        objects: Number of objects, or None for all numbers.
        fitted: True if the model may be fitted to this result.
        published: The published result as printed.
        target: Range of agreeing effect sizes, or None: a prediction interval, or for a pool a confidence
            interval.
        ours: The result of the study in words.
        agrees: True if both results agree, or None if this cannot be decided.
        rate: Share of the random studies from a pool that agree, or None without a pool.
        truth: Share of the random studies from a population with the published effects that agree.
        predictive_p: Two-sided p value of the published F if the population were like this study, or None.
            For a test without F, the probability that it is not significant.
        log_score: Log probability (density) of the published F if the population were like this study, or
            None.
        remark: The reason why no result exists, a contradiction between published numbers, or None.
    """

    kind: str
    measure: str
    what: str
    objects: int | None
    fitted: bool
    published: str
    target: Interval | None = None
    ours: str = ""
    agrees: bool | None = None
    rate: float | None = None
    truth: float | None = None
    predictive_p: float | None = None
    log_score: float | None = None
    remark: str | None = None


@dataclass(frozen=True)
class Score:
    """The score of a study: one row for each published result.

    Attributes:
        origin: Label that tells whether participants were simulated.
        people: Number of participants in cells of the published study.
        pool: True if the study is judged as a population.
        as_published: True if every cell has as many participants as in the published study.
        rows: The rows in the order of the published results.
        left_out: Participants in the table who are not judged.
        truths: Numbers of agreeing rows in studies with the published effects, by line of the summary.
        log_truths: Log scores of studies with the published effects, over the rows that have a log score.
    """

    origin: str
    people: int
    pool: bool
    as_published: bool
    rows: tuple[Row, ...]
    left_out: tuple[LeftOut, ...]
    truths: tuple[tuple[int, ...], ...] = ()
    log_truths: tuple[float, ...] = ()

    def summary(self) -> Iterator[tuple[str, str, int, int, int, str]]:
        """Yield name, fitted or not, numbers of agreeing, judged and all rows, and a reference range."""
        for k, (name, fitted, rows) in enumerate(_lines(self.rows)):
            low, high = np.quantile(self.truths[k], [0.05, 0.95], method="nearest")
            judged = [r for r in rows if r.agrees is not None]
            agree = sum(r.agrees is True for r in rows)
            yield (
                name,
                "fitted" if fitted else "not fitted",
                agree,
                len(judged),
                len(rows),
                f"{low} to {high}",
            )

    def log_score(self) -> float | None:
        """Return the sum of all log scores, or None if there are none. Larger values are better."""
        known = [r.log_score for r in self.rows if r.log_score is not None]
        return sum(known) if known else None


def _lines(rows: Iterable[Row]) -> list[tuple[str, bool, list[Row]]]:
    """Group rows by line of the summary. Rows about survey answers that are not simulated are omitted."""
    known = [r for r in rows if r.ours != NOT_SIMULATED]
    kinds = {
        "effect sizes and inferences": (EFFECT_SIZE, INFERENCE),
        "directions": (DIRECTION,),
        "variance orders": (VARIANCE,),
    }
    return [
        (name, fitted, [r for r in known if r.kind in of and r.fitted == fitted])
        for name, of in kinds.items()
        for fitted in (True, False)
    ]


def score(table: StudyTable, published: Published, *, seed: int = 0) -> Score:
    """Compare a study with the published one.

    Args:
        table: The participants of the study. Those outside the published cells are left out.
        published: The published results.
        seed: Seed for drawing random studies.

    Raises:
        StatisticsError: No participant is in a cell of the published study.
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
    true = [
        tuple(_Judge(study, published, (), scores=number < SCORED).rows())
        for number, study in enumerate(true_studies(inside, published, seed, TRUTHS))
    ]
    rows = tuple(
        replace(row, truth=None if ours[0].agrees is None else sum(o.agrees is True for o in ours) / TRUTHS)
        for row, *ours in zip(judge.rows(), *true, strict=True)
    )
    counts = [[sum(r.agrees is True for r in line) for *_, line in _lines(study)] for study in true]
    usual, truths = known == Counter(sizes), tuple(zip(*counts, strict=True))
    scored = [number for number, row in enumerate(rows) if row.log_score is not None]
    likely = tuple(sum(study[number].log_score or 0.0 for number in scored) for study in true[:SCORED])
    return Score(table.origin, len(inside.rows), is_pool, usual, rows, table.left_out, truths, likely)


@dataclass(frozen=True)
class _Judge:
    """Judges a table of participants, or a pool and the random studies that were drawn from it."""

    table: StudyTable
    published: Published
    replicates: tuple[StudyTable, ...]
    scores: bool = True  # whether to compute log scores
    known: dict[tuple[str, int | None], list[dict[str, FTest]]] = field(default_factory=dict)

    def rows(self) -> Iterator[Row]:
        for test in self.published.tests:
            yield from self._test_rows(test)
        for direction in self.published.directions:
            yield self._direction_row(direction)
        order = self.published.variances
        for objects in self.published.people.objects:
            row = Row(
                VARIANCE, order.measure, f"{order.largest} largest", objects, objects == 6, order.largest
            )
            rule = partial(varies_most, measure=order.measure, condition=order.largest, objects=objects)
            yield self._judged(row, rule)

    def _test_rows(self, test: PublishedTest) -> Iterator[Row]:
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
            test.fitted,
            printed,
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
        people = self.published.people_of(test.objects)
        low, high = target = prediction_interval(test, people, found.df2, found.people)
        size, ours = found.eta_squared, f"{found.eta_squared:.3f}"
        effect = effect_found(found) if self.scores else np.zeros(1)
        rate = None
        if self.replicates:
            again = prediction_interval(test, people, test.df[1], people)
            rate = self._rate([again[0] <= one.eta_squared <= again[1] for one in self._drawn(test)])
            size = population_eta_squared(self.table, self.published, test)
            ours, effect = f"{size:.3f} in the population", np.array([size / (1 - size)])
            low, high = target = population_interval(test, people)
        row = replace(row, target=target, ours=ours, agrees=low <= size <= high, rate=rate)
        if not self.scores:
            return row
        likely, p = log_score(test, people, effect)
        return replace(row, predictive_p=p, log_score=likely)

    def _inference(self, row: Row, test: PublishedTest, found: FTest) -> Row:
        drawn = [one.p < ALPHA for one in self._drawn(test)]
        rate = self._rate([one == test.significant for one in drawn])
        if rate is None:
            ours = f"F({found.df1},{found.df2:g}) = {found.statistic:.2f}, {p_text(found.p)}"
            return replace(row, ours=ours, agrees=(found.p < ALPHA) == test.significant)
        ours = f"p < .05 in {sum(drawn) / len(self.replicates):.0%}"
        return replace(row, ours=ours, agrees=rate > 0.5, rate=rate)

    def _drawn(self, test: PublishedTest) -> list[FTest]:
        """Return the test's results in all studies drawn from the pool in which it can be computed."""
        key = test.measure, test.objects
        if key not in self.known:
            self.known[key] = [found for t in self.replicates if (found := _tests(t, *key)) is not None]
        return [found[test.effect] for found in self.known[key]]

    def _direction_row(self, direction: Direction) -> Row:
        label = direction.label()
        printed = label if direction.p is None else f"{label}, p {direction.p}"
        row = Row(
            DIRECTION, direction.measure, label, direction.objects, direction.objects is not None, printed
        )
        if self._is_not_simulated(direction.measure):
            return replace(row, ours=NOT_SIMULATED)
        # The decision of a test depends on the sample size, so studies of the published size are used.
        return self._judged(row, partial(points, row=direction), by_rate=True)

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
        """Return the share of agreeing studies among those drawn from the pool, or None without a pool."""
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
