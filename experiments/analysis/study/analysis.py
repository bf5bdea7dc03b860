"""Analyse a study with descriptive statistics, tests and models."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, fields, is_dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.analysis.comparison import Interval, mean_interval
from experiments.analysis.statistics.anova import (
    EFFECTS,
    Values,
    brown_forsythe,
    hc3,
    one_way,
    two_way,
    welch,
    welch_james,
)
from experiments.analysis.statistics.effects import POWER, FTest, detectable_eta_squared
from experiments.analysis.statistics.mixed import (
    MIN_LEVELS,
    HouseDifference,
    MixedModel,
    WaldTest,
    differences_by_house,
    mixed_model,
)
from experiments.analysis.statistics.mixtures import fit_mixtures
from experiments.analysis.statistics.models import Chi2Test, OrdinalModel, diagnose, ordinal_model
from experiments.analysis.statistics.pairs import compare_pairs
from experiments.analysis.study.measures import LIKERT_PREFIX, Measures
from experiments.analysis.study.table import StudyTable
from experiments.errors import StatisticsError
from hud.conditions import hides_plan

ONE_WAY, TWO_WAY = "one-way", "two-way, Type II"
MIXED, ROOMS, BY_HOUSE = "mixed model", "rooms", "by house"
OUT_OF_MEMORY = "not enough memory; analyse fewer trials, or trials with fewer people, houses or conditions"
STRICT = "nd_strict_2n"  # measure from which the number of deviations is computed


Test = FTest | WaldTest | Chi2Test


@dataclass(frozen=True)
class AnalysisResult:
    """The result of a test or model, or the reason for its absence. If `objects` is None, all trials were used."""

    measure: str
    kind: str
    objects: int | None
    value: Any
    reason: str | None


@dataclass(frozen=True)
class Description:
    """Descriptive statistics of a measure in one cell. A single value has no interval and no deviation."""

    measure: str
    assistance: str
    objects: int
    people: int
    mean: float
    interval: Interval
    deviation: float | None
    median: float


@dataclass(frozen=True)
class Analysis:
    """All results of an analysis: descriptive statistics, tests and models."""

    table: StudyTable
    measures: Measures
    descriptions: tuple[Description, ...]
    results: tuple[AnalysisResult, ...]

    def find(self, measure: str, kind: str, objects: int | None = None) -> AnalysisResult | None:
        wanted = measure, kind, objects
        return next((r for r in self.results if (r.measure, r.kind, r.objects) == wanted), None)

    def as_json(self) -> dict[str, Any]:
        sizes = [{"assistance": c, "objects": n, "people": k} for (c, n), k in self.table.sizes().items()]
        return {
            "origin": self.table.origin,
            "people": len(self.table.rows),
            "cells": sizes,
            "notes": list(self.table.notes),
            "left_out": [asdict(person) for person in self.table.left_out],
            "gaps": [asdict(gap) for gap in self.table.gaps],
            "columns": dict(self.table.sources),
            "descriptions": [asdict(d) for d in self.descriptions],
            "results": [vars(r) | {"value": plain(r.value)} for r in self.results],
        }


def plain(value: Any) -> Any:
    if isinstance(value, FTest):
        return value.as_json()
    if isinstance(value, dict):
        return {name: plain(one) for name, one in value.items()}
    if isinstance(value, list):
        return [plain(one) for one in value]
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    return value


def analyse(table: StudyTable, measures: Measures) -> Analysis:
    """Compute all descriptive statistics, tests and models that the data allow."""
    results = test_results(table, measures)
    for name in table.columns:
        if name in measures.objective or name.startswith(LIKERT_PREFIX):
            for objects in table.levels():
                work = partial(compare_pairs, table.groups(name, objects), measures.equivalence.pair)
                results.append(_attempt(name, "pairs", objects, work))
        if name in measures.objective:
            results.append(_attempt(name, BY_HOUSE, None, partial(_by_house, table, name)))
            results.append(_attempt(name, "diagnostics", None, partial(diagnose, cells_of(table, name))))
    results += [more for r in results for more in _sensitivity(r, measures)]
    results += _acceptance(table)
    return Analysis(table, measures, tuple(_describe(table)), tuple(results))


def test_results(table: StudyTable, measures: Measures) -> list[AnalysisResult]:
    """Compute all F tests, mixed models and ordinal models of a study."""
    results = []
    for name in table.columns:
        answers = name.startswith(LIKERT_PREFIX)
        for objects in table.levels():
            results += _answer_tests(table, name, objects) if answers else one_way_tests(table, name, objects)
        if len(table.levels()) > 1 and not answers:
            results += two_way_tests(table, name)
        if name in measures.objective:
            results.append(_attempt(name, MIXED, None, partial(_mixed, table, name)))
            if len(set(table.numbers(ROOMS).tolist())) > 1:
                work = partial(_mixed, table, name, ROOMS)
                results.append(_attempt(name, f"{MIXED}, {ROOMS}", None, work))
    return results


def tests_of(result: AnalysisResult) -> Iterator[tuple[str, Test]]:
    """Yield the tests in a result, each with the name of the tested effect."""
    if isinstance(result.value, FTest):
        yield EFFECTS[0], result.value
    elif isinstance(result.value, OrdinalModel):
        yield EFFECTS[0], result.value.test
    elif isinstance(result.value, MixedModel):
        yield from result.value.tests.items()
    elif isinstance(result.value, dict):
        yield from ((effect, test) for effect, test in result.value.items() if isinstance(test, FTest))


def _attempt(measure: str, kind: str, objects: int | None, work: Callable[[], Any]) -> AnalysisResult:
    try:
        return AnalysisResult(measure, kind, objects, work(), None)
    except StatisticsError as error:
        return AnalysisResult(measure, kind, objects, None, str(error))
    except MemoryError:
        return AnalysisResult(measure, kind, objects, None, OUT_OF_MEMORY)


def _sensitivity(result: AnalysisResult, measures: Measures) -> Iterator[AnalysisResult]:
    test, bound = result.value, measures.equivalence.eta_squared
    if result.kind == ONE_WAY and test is not None and not result.measure.startswith(LIKERT_PREFIX):
        size = detectable_eta_squared(test.df1, test.df2, test.people)
        of = result.measure, result.objects
        yield AnalysisResult(
            of[0], "equivalence", of[1], {"bound": bound, "p": test.p_of_equivalence(bound)}, None
        )
        yield AnalysisResult(of[0], "power", of[1], {"power": POWER, "detectable_eta_squared": size}, None)


def one_way_tests(table: StudyTable, name: str, objects: int) -> list[AnalysisResult]:
    groups = table.groups(name, objects)
    members = [c for c, values in groups.items() for _ in values]
    pooled = np.concatenate([np.empty(0), *groups.values()]), np.array(members), np.zeros(len(members))
    return [
        _attempt(name, ONE_WAY, objects, partial(one_way, groups)),
        _attempt(name, "welch", objects, partial(welch, groups)),
        _attempt(name, "brown-forsythe", objects, partial(brown_forsythe, groups)),
        _attempt(name, "HC3", objects, lambda: hc3(*pooled)[EFFECTS[0]]),
    ]


def two_way_tests(table: StudyTable, name: str) -> list[AnalysisResult]:
    known = ~np.isnan(table.columns[name])
    factors = table.columns[name][known], table.assistance[known], table.objects[known]
    return [
        _attempt(name, TWO_WAY, None, partial(two_way, *factors)),
        _attempt(name, "two-way, Type III", None, partial(two_way, *factors, kind=3)),
        _attempt(name, "two-way, Welch-James", None, partial(welch_james, *factors)),
        _attempt(name, "two-way, HC3", None, partial(hc3, *factors)),
    ]


def cells_of(table: StudyTable, name: str) -> dict[str, Values]:
    """Return the known values of a measure, grouped by condition and number of objects."""
    return {f"{c}, {n}": v for n in table.levels() for c, v in table.groups(name, n).items()}


def _mixed(table: StudyTable, name: str, covariate: str | None = None) -> Any:
    values, known = table.columns[name], ~np.isnan(table.columns[name])
    if covariate is not None:
        known &= ~np.isnan(table.numbers(covariate))
    here = table.take(np.flatnonzero(known))
    if len(set(here.assistance.tolist())) < 2:
        raise StatisticsError("there is only one assistance condition")
    with_covariate = None if covariate is None else (covariate, here.numbers(covariate))
    return mixed_model(values[known], here.assistance, here.objects, random_factors(here), with_covariate)


def random_factors(table: StudyTable) -> dict[str, NDArray[Any]]:
    """Return the random factors that can be estimated from the data, such as participants and houses."""
    rows, houses = len(table.rows), len(set(table.houses.tolist()))
    found: dict[str, NDArray[Any]] = {}
    if MIN_LEVELS <= len(set(table.people.tolist())) < rows:
        found["person"] = table.people
        trials = table.numbers("trial_number")
        # A variance cannot be estimated from only two levels.
        if len(set(trials.tolist())) > 2 and not np.isnan(trials).any():
            found["trial_number"] = trials
    if houses >= MIN_LEVELS or not found:
        found["house"] = table.houses
        both = np.char.add(np.char.add(table.houses, "/"), table.assistance)
        if houses < len(set(both.tolist())) < rows:
            found["house x assistance"] = both
    return found


def _by_house(table: StudyTable, name: str) -> list[HouseDifference]:
    known = ~np.isnan(table.columns[name])
    here = table.take(np.flatnonzero(known))
    return differences_by_house(
        table.columns[name][known], here.assistance, here.objects, here.houses, here.conditions()
    )


def _acceptance(table: StudyTable) -> list[AnalysisResult]:
    if STRICT not in table.columns:
        return [AnalysisResult(STRICT, "acceptance", None, None, f"{STRICT} is not known")]
    results = []
    for condition in (name for name in table.conditions() if not hides_plan(name)):
        made = table.visits()
        here = (table.assistance == condition) & ~np.isnan(table.columns[STRICT]) & (made > 0)
        visits = made[here]
        deviations = np.rint(table.columns[STRICT][here] * 2 * table.objects[here]).astype(int)
        # Dropped objects count as deviations if the table has no column `visits`.
        accepted = np.clip(visits - deviations, 0, visits)
        kind = f"acceptance, {condition}"
        results.append(_attempt(STRICT, kind, None, partial(fit_mixtures, accepted, visits)))
    return results


def _answer_tests(table: StudyTable, name: str, objects: int) -> list[AnalysisResult]:
    groups: Mapping[str, Values] = table.groups(name, objects)
    return [
        _attempt(name, ONE_WAY, objects, partial(one_way, groups)),
        _attempt(name, "ordinal", objects, partial(ordinal_model, groups)),
    ]


def _describe(table: StudyTable) -> list[Description]:
    found = []
    for name in table.columns:
        for objects in table.levels():
            for condition, values in table.groups(name, objects).items():
                spread = float(values.std(ddof=1)) if len(values) > 1 else None
                mean, median = float(values.mean()), float(np.median(values))
                interval = mean_interval(values)
                found.append(
                    Description(name, condition, objects, len(values), mean, interval, spread, median)
                )
    return found
