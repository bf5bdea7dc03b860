"""Create the HTML report of a study, with all figures, tests and models in one file."""

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from experiments.analysis.page import (
    Block,
    Paragraph,
    TableBlock,
    freedom,
    p_text,
    p_value,
    page,
    shown,
    table,
)
from experiments.analysis.report.assumptions import assumptions, specification_curve
from experiments.analysis.report.figures import answers, by_condition, interactions, paths_figure, variances
from experiments.analysis.report.summary import summary
from experiments.analysis.statistics.effects import FTest
from experiments.analysis.statistics.mixed import MixedModel
from experiments.analysis.statistics.models import OrdinalModel
from experiments.analysis.study.analysis import (
    BY_HOUSE,
    MIXED,
    ONE_WAY,
    ROOMS,
    STRICT,
    TWO_WAY,
    Analysis,
    AnalysisResult,
    tests_of,
)
from experiments.analysis.study.measures import LIKERT_PREFIX
from experiments.analysis.study.robustness import Selection
from experiments.errors import ExperimentError
from experiments.record.phases import RECORDED, REHEARSED
from experiments.trials.design import counted
from mjsim.values.errors import MjsimError

TITLE = "Study of assistance and difficulty"
CAUTION = (
    "These people were simulated. The numbers follow from a model and are not evidence about people. Answers to survey "
    "questions are not simulated."
)
REHEARSAL = (
    "This is a rehearsal without people. Answers were drawn at random, so no number here has any meaning."
)
TEST_HEAD = ("measure", "test", "effect", "objects", "F", "df", "p", "partial η²", "90 % interval")
PAIR_HEAD = (
    *("measure", "objects", "pair", "difference", "95 % interval", "Tukey p", "Games-Howell p", "Holm p"),
    *("decisions at .05", "g", "95 % interval", "equivalent within ±", "equivalence Holm p", "verdict"),
)


def report(analysis: Analysis, folder: Path, selection: Selection) -> str:
    """Return the HTML report of an analysis. Walked paths are drawn if `folder` contains run directories."""
    parts = (
        ("Summary", _summary(analysis)),
        ("People", _people(analysis)),
        *selection.sections(analysis.table),
        ("Measures by condition", _figures(analysis)),
        ("Answers", _answers(analysis)),
        ("Analyses of variance", _tests(analysis)),
        ("Assumptions", assumptions(analysis, _labels(analysis))),
        ("Readings and analyses of each measure", _curves(analysis)),
        ("Pairs of conditions", _pairs(analysis)),
        ("Kinds of people by acceptance", _mixtures(analysis)),
        ("Houses", _houses(analysis)),
        ("People and houses as random factors", _mixed(analysis)),
        ("Sensitivity of such a study", _power(analysis)),
        ("Optimal and walked paths", _paths(analysis, folder)),
        ("What could not be computed", _missing(analysis)),
    )
    return page(TITLE, analysis.table.origin, parts)


def _summary(analysis: Analysis) -> Iterator[Block]:
    labels = _labels(analysis)
    yield from map(Paragraph, summary(analysis, labels))
    effects, pairs = [], []
    for name, objects in ((n, o) for n in labels for o in (*analysis.table.levels(), None)):
        result = analysis.find(name, ONE_WAY if objects else TWO_WAY, objects)
        for effect, t in _f_tests([result] if result else []):
            shown_test = f"F({freedom(t)}) = {shown(t.statistic)}, {p_text(t.p)}"
            effects.append((labels[name], effect, objects or "all", t.eta_squared, t.interval, shown_test))
        compared = analysis.find(name, "pairs", objects)
        for p in compared.value if compared is not None and compared.value else ():
            pair = f"{p.second} - {p.first}"
            pairs.append(
                (labels[name], pair, objects, p.difference, p.interval, p_value(p.tukey_p), p.verdict)
            )
    yield table(("measure", "effect of", "objects", "partial η²", "90 % interval", "test"), effects)
    yield table(
        ("measure", "difference", "objects", "estimate", "95 % interval", "Tukey p", "verdict"), pairs
    )


def _people(analysis: Analysis) -> Iterator[Block]:
    found, levels = analysis.table, analysis.table.levels()
    if found.origin == REHEARSED:
        yield Paragraph(REHEARSAL)
    elif found.origin != RECORDED:
        yield Paragraph(CAUTION)
    sizes = found.sizes()
    rows = [(condition, *(sizes[condition, n] for n in levels)) for condition in found.conditions()]
    yield table(("people", *(counted(n, "object") for n in levels)), rows)
    yield from map(Paragraph, found.notes)
    measures = analysis.measures.objective
    yield table(
        ("measure", "column", "why"),
        [(measures[n].label, found.sources[n], measures[n].why) for n in measures if n in found.sources],
    )


def _labels(analysis: Analysis) -> dict[str, str]:
    found = {}
    for name, measure in analysis.measures.objective.items():
        if name in analysis.table.columns:
            seconds = analysis.table.sources[name] == measure.without
            found[name] = f"{measure.label} (s)" if seconds else measure.axis()
    return found


def _figures(analysis: Analysis) -> Iterator[Block]:
    found, labels = analysis.table, _labels(analysis)
    if not labels:
        return
    yield by_condition(found, labels)
    if len(found.levels()) > 1:
        yield interactions(found, labels)
    name = next(iter(labels))
    if found.groups(name):
        yield variances(found, name, labels[name])
    rows = [d for d in analysis.descriptions if d.measure in labels]
    yield table(
        ("measure", "condition", "objects", "people", "mean", "95 % interval", "SD", "median"),
        [
            (labels[d.measure], d.assistance, d.objects, d.people, d.mean, d.interval, d.deviation, d.median)
            for d in rows
        ],
    )


def _answers(analysis: Analysis) -> tuple[Block, ...]:
    if not any(name.startswith(LIKERT_PREFIX) for name in analysis.table.columns):
        simulated = analysis.table.origin != RECORDED
        return (Paragraph("Not simulated." if simulated else "No answers are recorded."),)
    models = [(r, r.value) for r in analysis.results if isinstance(r.value, OrdinalModel)]
    rows = [
        (
            analysis.measures.answers()[r.measure],
            r.objects,
            m.people,
            m.test.statistic,
            m.test.df,
            p_value(m.test.p),
            ", ".join(f"{name} {shown(ratio)}" for name, ratio in m.odds_ratios.items()),
        )
        for r, m in models
    ]
    head = ("answer", "objects", "people", "χ²", "df", "p", "odds of a higher answer")
    return answers(analysis), table(head, rows)


def _tests(analysis: Analysis) -> Iterator[Block]:
    scored = analysis.measures.objective
    names = {name: scored[name].label for name in _labels(analysis)} | analysis.measures.answers()
    rows = [
        (
            *(names[r.measure], r.kind, effect, r.objects or "all"),
            *(t.statistic, freedom(t), p_value(t.p), t.eta_squared, t.interval),
        )
        for r in analysis.results
        if r.measure in names
        for effect, t in _f_tests([r])
    ]
    yield table(TEST_HEAD, rows)
    if rows:
        yield Paragraph(
            "Partial η² is a share of the variance. In Welch's test, Welch-James and HC3 each group counts in units of "
            "its own variance; in Brown and Forsythe's it is a share of the variance of the distances from the medians."
        )


def _f_tests(results: Iterable[AnalysisResult]) -> Iterator[tuple[str, FTest]]:
    for result in results:
        yield from ((effect, test) for effect, test in tests_of(result) if isinstance(test, FTest))


def _curves(analysis: Analysis) -> Iterator[Block]:
    for name, label in _labels(analysis).items():
        if (curve := specification_curve(analysis, name, label)) is not None:
            yield curve


def _pairs(analysis: Analysis) -> tuple[Block, ...]:
    rows, names = [], _labels(analysis) | analysis.measures.answers()
    for result in (r for r in analysis.results if r.kind == "pairs" and r.value):
        for p in result.value:
            corrected = (p_value(p.tukey_p), p_value(p.games_howell_p), p_value(p.holm_p))
            same = "the same" if p.agrees() else "differ"
            size = (same, p.g, p.g_interval, p.equivalence_bound, p_value(p.equivalence_holm_p), p.verdict)
            pair = f"{p.second} - {p.first}"
            rows.append(
                (names[result.measure], result.objects, pair, p.difference, p.interval, *corrected, *size)
            )
    bound = analysis.measures.equivalence.pair
    about = Paragraph(
        f"Equivalent: Tukey's test finds no difference, and two one-sided tests show that it is below {bound:g} "
        "standard deviations (in the unit of the measure: equivalent within). Undecided: neither is shown; that is no "
        "evidence of no effect. All p values are corrected for the pairs of one measure and number of objects. "
        "Tukey's test assumes equal variances. Games-Howell and Holm, after Welch's tests, do not; where they differ "
        "from Tukey's test and the variances are unequal, rely on them."
    )
    return (TableBlock(PAIR_HEAD, rows), *([about] if rows else []))


def _mixtures(analysis: Analysis) -> tuple[Block, ...]:
    rows = [
        (r.kind.removeprefix("acceptance, "), len(m.shares), m.shares, m.means, m.log_likelihood, m.bic)
        for r in analysis.results
        if r.measure == STRICT and r.kind.startswith("acceptance") and r.value
        for m in r.value
    ]
    about = Paragraph(
        "Mixtures of beta-binomial distributions of accepted visits, for conditions that show a plan. The smallest BIC "
        "fits best."
    )
    head = ("condition", "kinds", "shares", "mean acceptance", "log likelihood", "BIC")
    return (about, TableBlock(head, rows)) if rows else ()


def _mixed(analysis: Analysis) -> Iterator[Block]:
    labels = _labels(analysis)
    models = [(r, r.value) for r in analysis.results if isinstance(r.value, MixedModel)]
    tests = [
        (labels[r.measure], r.kind, effect, t.statistic, freedom(t), p_value(t.p))
        for r, m in models
        for effect, t in m.tests.items()
    ]
    yield table(("measure", "model", "effect", "Wald F", "df", "p"), tests)
    shares = [
        (labels[r.measure], name, factor.levels, factor.variance, factor.share, factor.interval)
        for r, m in models
        if r.kind == MIXED
        for name, factor in m.random.items()
    ]
    head = (
        "measure",
        "random factor",
        "levels",
        "variance (unit²)",
        "share of the variance",
        "95 % interval",
    )
    yield table(head, shares)
    if shares:
        yield Paragraph(
            "Shares are of the variance within conditions; the rest is between trials. House x assistance is how much "
            "the differences between conditions themselves differ from house to house."
        )


def _houses(analysis: Analysis) -> Iterator[Block]:
    found, labels = analysis.table, _labels(analysis)
    rooms, area, density = found.numbers(ROOMS), found.numbers("area_m2"), found.densities()
    rows = []
    is_one = len({row.get("house") for row in found.rows}) < 2  # perhaps in several layouts
    for count in sorted(set() if is_one else set(rooms[~np.isnan(rooms)].tolist())):
        homes = found.take(np.flatnonzero(rooms == count))
        means = (homes.groups(name).get(c) for name in labels for c in found.conditions())
        about = len(set(homes.houses.tolist())), len(homes.rows)
        sizes = float(np.mean(area[rooms == count])), float(np.mean(density[rooms == count]))
        rows.append((int(count), *about, *sizes, *("" if v is None else float(v.mean()) for v in means)))
    means_head = (f"{label}: {c}" for label in labels.values() for c in found.conditions())
    yield table(("rooms", "houses", "trials", "m²", "objects per m²", *means_head), rows)
    pairs = [
        (labels[r.measure], f"{d.second} - {d.first}", d.difference, d.interval)
        for r in analysis.results
        if r.kind == BY_HOUSE and r.value
        for d in r.value
    ]
    yield table(("measure", "pair", "difference", "95 % interval, houses drawn again"), pairs)


def _power(analysis: Analysis) -> tuple[Block, ...]:
    rows, labels = [], _labels(analysis)
    for r in (r for r in analysis.results if r.kind == "power" and r.measure in labels):
        equivalence = analysis.find(r.measure, "equivalence", r.objects)
        p = None if equivalence is None else p_value(equivalence.value["p"])
        rows.append((labels[r.measure], r.objects, r.value["detectable_eta_squared"], p))
    bound = analysis.measures.equivalence.eta_squared
    head = ("measure", "objects", "partial η² found in 80 % of such studies", f"p of η² ≥ {bound:g}")
    return (TableBlock(head, rows),)


def _paths(analysis: Analysis, folder: Path) -> tuple[Block, ...]:
    try:
        return (paths_figure(analysis.table, folder),)
    except (ExperimentError, MjsimError) as error:
        return (Paragraph(f"Not drawn: {error}.", "missing"),)


def _missing(analysis: Analysis) -> tuple[Block, ...]:
    rows: list[AnalysisResult] = [r for r in analysis.results if r.reason is not None]
    reasons = [(r.measure, r.kind, r.objects, r.reason) for r in rows]
    return (TableBlock(("measure", "test", "objects", "reason"), reasons),)
