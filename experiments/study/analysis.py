"""The analysis of a study: descriptions, tests and models; those that cannot be computed give a reason."""

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, is_dataclass
from functools import partial
from typing import Any

import numpy as np

from experiments.analysis.comparison import Interval, mean_interval
from experiments.analysis.statistics.anova import Values, brown_forsythe, one_way, two_way, welch
from experiments.analysis.statistics.effects import FTest
from experiments.analysis.statistics.mixed import mixed_model
from experiments.analysis.statistics.mixtures import fit_mixtures
from experiments.analysis.statistics.models import ordinal_model
from experiments.analysis.statistics.pairs import compare_pairs
from experiments.analysis.statistics.power import POWER, detectable_eta_squared
from experiments.errors import StatisticsError
from experiments.study.measures import LIKERT_PREFIX, Measures
from experiments.study.table import StudyTable

STRICT = "nd_strict_2n"  # holds how many visits deviated, as its denominator is known


@dataclass(frozen=True)
class Result:
    """A test or model of a measure at a number of objects (None: over all), or the reason why it has no value."""

    measure: str
    kind: str
    objects: int | None
    value: Any
    reason: str | None


@dataclass(frozen=True)
class Description:
    """A measure in a cell; `interval` is Student's 95 % confidence interval of the mean, None for one person."""

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
    """The people and measures of a study, with descriptions by measure and cell, tests and models."""

    table: StudyTable
    measures: Measures
    descriptions: tuple[Description, ...]
    results: tuple[Result, ...]

    def find(self, measure: str, kind: str, objects: int | None = None) -> Result | None:
        """The result of this measure, kind and number of objects."""
        wanted = measure, kind, objects
        return next((r for r in self.results if (r.measure, r.kind, r.objects) == wanted), None)

    def as_json(self) -> dict[str, Any]:
        """All of it, for stats.json."""
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
            "results": [vars(r) | {"value": _plain(r.value)} for r in self.results],
        }


def _plain(value: Any) -> Any:
    if isinstance(value, FTest):
        return value.as_json()
    if isinstance(value, dict):
        return {name: _plain(one) for name, one in value.items()}
    if isinstance(value, list):
        return [_plain(one) for one in value]
    return asdict(value) if is_dataclass(value) and not isinstance(value, type) else value


def analyse(table: StudyTable, measures: Measures) -> Analysis:
    """Compute all descriptions, tests and models that the data allow."""
    results = []
    for name in (n for n in table.columns if not n.startswith(LIKERT_PREFIX)):
        results += [r for objects in table.levels() for r in _one_way(table, measures, name, objects)]
        if len(table.levels()) > 1:
            results += two_way_tests(table, name)
        if name in measures.objective:
            results.append(_attempt(name, "mixed model", None, partial(_mixed, table, name)))
    results += _acceptance(table)
    for name in (n for n in table.columns if n.startswith(LIKERT_PREFIX)):
        results += [r for objects in table.levels() for r in _likert(table, measures, name, objects)]
    return Analysis(table, measures, tuple(_describe(table)), tuple(results))


def _attempt(measure: str, kind: str, objects: int | None, work: Callable[[], Any]) -> Result:
    try:
        return Result(measure, kind, objects, work(), None)
    except StatisticsError as error:
        return Result(measure, kind, objects, None, str(error))


def _one_way(table: StudyTable, measures: Measures, name: str, objects: int) -> list[Result]:
    groups = table.groups(name, objects)
    results = one_way_tests(table, name, objects)
    if name in measures.objective:
        results.append(
            _attempt(name, "pairs", objects, partial(compare_pairs, groups, measures.equivalence.pair))
        )
    test = results[0].value
    if test is not None:
        size = detectable_eta_squared(test.df1, test.df2, test.people)
        equivalence = {
            "bound": measures.equivalence.eta_squared,
            "p": test.p_of_equivalence(measures.equivalence.eta_squared),
        }
        results.append(Result(name, "equivalence", objects, equivalence, None))
        results.append(Result(name, "power", objects, {"power": POWER, "detectable_eta_squared": size}, None))
    return results


def one_way_tests(table: StudyTable, name: str, objects: int) -> list[Result]:
    """F tests of a measure at a number of objects."""
    groups = table.groups(name, objects)
    return [
        _attempt(name, "one-way", objects, partial(one_way, groups)),
        _attempt(name, "welch", objects, partial(welch, groups)),
        _attempt(name, "brown-forsythe", objects, partial(brown_forsythe, groups)),
    ]


def two_way_tests(table: StudyTable, name: str) -> list[Result]:
    """F tests of a measure over all numbers of objects."""
    known = ~np.isnan(table.columns[name])
    factors = table.columns[name][known], table.assistance[known], table.objects[known]
    return [
        _attempt(name, f"two-way, Type {numeral}", None, partial(two_way, *factors, kind=kind))
        for kind, numeral in ((2, "II"), (3, "III"))
    ]


def _mixed(table: StudyTable, name: str) -> Any:
    known = ~np.isnan(table.columns[name])
    if len(set(table.assistance[known].tolist())) < 2:
        raise StatisticsError("there is only one assistance condition")
    return mixed_model(
        table.columns[name][known], table.assistance[known], table.objects[known], table.houses[known]
    )


def _acceptance(table: StudyTable) -> list[Result]:
    """Mixtures by condition, over the visits that each person made."""
    if STRICT not in table.columns:
        return [Result(STRICT, "acceptance", None, None, f"{STRICT} is not known")]
    results = []
    for condition in table.conditions():
        made = table.visits()
        here = (table.assistance == condition) & ~np.isnan(table.columns[STRICT]) & (made > 0)
        visits = made[here]
        deviations = np.rint(table.columns[STRICT][here] * 2 * table.objects[here]).astype(int)
        accepted = np.clip(visits - deviations, 0, visits)  # without `visits`, drops count as deviations only
        kind = f"acceptance, {condition}"
        results.append(_attempt(STRICT, kind, None, partial(fit_mixtures, accepted, visits)))
    return results


def _likert(table: StudyTable, measures: Measures, name: str, objects: int) -> list[Result]:
    groups: Mapping[str, Values] = table.groups(name, objects)
    return [
        _attempt(name, "one-way", objects, partial(one_way, groups)),
        _attempt(name, "ordinal", objects, partial(ordinal_model, groups)),
        _attempt(name, "pairs", objects, partial(compare_pairs, groups, measures.equivalence.pair)),
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
