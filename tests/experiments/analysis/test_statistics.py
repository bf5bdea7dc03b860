"""Statistics of studies: against textbook formulas written out here, statsmodels' own analyses, and known truths."""

import functools
import itertools
import math

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats
from statsmodels.formula.api import ols
from statsmodels.stats.anova import anova_lm
from study_people import SIZES

from experiments.analysis.statistics import variance_components
from experiments.analysis.statistics.anova import brown_forsythe, cells_of, one_way, two_way, welch
from experiments.analysis.statistics.effects import (
    FTest,
    detectable_eta_squared,
    hedges_g,
    people_per_cell,
    power_of,
)
from experiments.analysis.statistics.mixed import differences_by_house, mixed_model
from experiments.analysis.statistics.mixtures import fit_mixtures
from experiments.analysis.statistics.models import ordinal_model
from experiments.analysis.statistics.pairs import compare_pairs, tukey_differs
from experiments.errors import StatisticsError

EXACT = {"rel": 1e-8, "abs": 1e-12}


def groups(sizes=(40, 37, 42)):
    rng = np.random.default_rng(0)
    cases = zip(("none", "highlight", "optimal"), sizes, (0.0, 0.1, 0.8), (1.0, 1.5, 0.7), strict=True)
    return {name: rng.normal(mean, spread, size) for name, size, mean, spread in cases}


@pytest.mark.parametrize(
    ("test", "smallest", "expected"),
    [
        (one_way, 40, stats.f_oneway),
        (one_way, 1, stats.f_oneway),
        (welch, 40, functools.partial(stats.f_oneway, equal_var=False)),
    ],
)
def test_one_factor_is_analysed_as_by_scipy(test, smallest, expected):
    data = groups(sizes=(smallest, 37, 42))
    found, peer = test(data), expected(*data.values())
    assert (found.df1, found.people) == (2, smallest + 79)
    assert test is welch or found.df2 == smallest + 76
    assert (found.statistic, found.p) == pytest.approx((peer.statistic, peer.pvalue), **EXACT)
    share = 2 * found.statistic / (2 * found.statistic + smallest + 76)
    assert found.eta_squared == pytest.approx(share, **EXACT)


@pytest.mark.parametrize("sizes", [(3, 4, 5), (40, 37, 42), (2, 2, 9)])
def test_variances_are_compared_without_what_the_median_takes(sizes):
    """Every group is turned such that its median is one axis; the rest, n - 1 coordinates, are the distances."""
    data, distances = groups(sizes), []
    for values in data.values():
        deviations, n = np.sort(values) - np.median(values), len(values)
        turn = np.eye(n)
        if n % 2 == 0:
            middle = slice(n // 2 - 1, n // 2 + 1)
            turn[middle, middle] = np.array([[1.0, 1.0], [-1.0, 1.0]]) / np.sqrt(2.0)
        assert (turn @ deviations)[(n - 1) // 2] == pytest.approx(0.0, abs=1e-15)
        distances.append(np.abs(np.delete(turn @ deviations, (n - 1) // 2)))
    found, peer = brown_forsythe(data), stats.f_oneway(*distances)
    assert (found.df1, found.df2, found.people) == (2, sum(sizes) - 6, sum(sizes))
    assert (found.statistic, found.p) == pytest.approx((peer.statistic, peer.pvalue), **EXACT)


def test_variances_of_pairs_alone_are_not_compared():
    with pytest.raises(StatisticsError, match="at most two people"):
        brown_forsythe(groups((2, 2, 2)))


@pytest.mark.parametrize("kind", [2, 3])
def test_two_factors_are_analysed_as_by_statsmodels(kind):
    cells = [cell for cell, count in SIZES.items() for _ in range(count)]
    first, second = (np.array([cell[k] for cell in cells]) for k in (0, 1))
    values = np.random.default_rng(1).normal(size=447) + (first == "optimal") + 0.02 * second
    data = pd.DataFrame({"y": values, "a": first, "b": second})
    table = anova_lm(ols("y ~ C(a, Sum) * C(b, Sum)", data).fit(), typ=kind)
    names = ("C(a, Sum)", "C(b, Sum)", "C(a, Sum):C(b, Sum)")
    for test, name in zip(two_way(values, first, second, kind).values(), names, strict=True):
        assert (test.df1, test.df2) == (table["df"][name], 435)
        assert (test.statistic, test.p) == pytest.approx((table["F"][name], table["PR(>F)"][name]), **EXACT)


def test_pairs_agree_with_scipy_and_with_formulas():
    data = groups()
    found = compare_pairs(data, bound=0.5)
    tukey = stats.tukey_hsd(*data.values())
    unequal = stats.tukey_hsd(*data.values(), equal_var=False)
    interval = tukey.confidence_interval(0.95)
    spread = math.sqrt(sum(((v - v.mean()) ** 2).sum() for v in data.values()) / 116)
    for pair, (k, m) in zip(found, itertools.combinations(range(3), 2), strict=True):
        one, other = list(data.values())[k], list(data.values())[m]
        assert pair.difference == pytest.approx(other.mean() - one.mean(), **EXACT)
        assert pair.tukey_p == pytest.approx(tukey.pvalue[k, m], rel=1e-8, abs=1e-10)
        assert pair.games_howell_p == pytest.approx(unequal.pvalue[k, m], rel=1e-8, abs=1e-10)
        assert (pair.tukey_p < 0.05) == tukey_differs(data, pair.first, pair.second)
        assert pair.interval == pytest.approx((interval.low[m, k], interval.high[m, k]), rel=1e-8)
        # Two one-sided Welch tests.
        a, b = one.var(ddof=1) / len(one), other.var(ddof=1) / len(other)
        df = (a + b) ** 2 / (a**2 / (len(one) - 1) + b**2 / (len(other) - 1))
        gap = other.mean() - one.mean()
        sides = [stats.t.sf((0.5 * spread + side * gap) / math.sqrt(a + b), df) for side in (1, -1)]
        assert pair.equivalence_p == pytest.approx(max(sides), **EXACT)


def test_equivalence_is_corrected_for_the_number_of_pairs():
    rng = np.random.default_rng(4)
    found = compare_pairs({name: rng.normal(size=90) for name in "abc"}, 0.5)
    # Smallest times 3, next times 2, and so on, never falling.
    low, middle, high = sorted(found, key=lambda pair: pair.equivalence_p)
    assert low.equivalence_holm_p == pytest.approx(3 * low.equivalence_p, **EXACT)
    assert middle.equivalence_holm_p == pytest.approx(2 * middle.equivalence_p, **EXACT)
    assert high.equivalence_holm_p == pytest.approx(
        max(2 * middle.equivalence_p, high.equivalence_p), **EXACT
    )
    assert [pair.verdict for pair in found] == ["undecided", "undecided", "equivalent"]
    assert [pair.equivalence_p < 0.05 for pair in found] == [False, True, True], "without a correction"


def test_tests_of_a_pair_that_decide_differently_are_marked():
    """A small group with a large variance: only Tukey's test, which assumes equal variances, finds a difference."""
    rng = np.random.default_rng(0)
    found = compare_pairs(
        {"a": rng.normal(0, 0.3, 60), "b": rng.normal(0.9, 3.0, 12), "c": rng.normal(0, 0.3, 60)}, 0.5
    )
    assert [pair.agrees() for pair in found] == [False, True, False]


def test_a_group_without_variance_is_compared_by_tukey_alone():
    rng = np.random.default_rng(1)
    found = compare_pairs({"a": np.full(20, 3.0), "b": rng.normal(size=20), "c": rng.normal(size=20)}, 0.5)
    assert [pair.games_howell_p is None for pair in found] == [True, True, False]
    assert [pair.holm_p is None for pair in found] == [True, True, False]


def test_verdicts_need_evidence():
    """No difference is not equivalence: few people are undecided, many equal ones equivalent."""
    rng = np.random.default_rng(2)
    few = {name: rng.normal(size=8) for name in "ab"}
    many = {name: rng.normal(size=400) for name in "ab"}
    apart = {"a": rng.normal(size=50), "b": rng.normal(3, 1, 50)}
    verdicts = [compare_pairs(data, 0.5)[0].verdict for data in (few, many, apart)]
    assert verdicts == ["undecided", "equivalent", "different"]


def test_hedges_g_by_its_formula():
    data = groups()
    one, other = data["none"], data["optimal"]
    n, m = len(one), len(other)
    spread = math.sqrt(((n - 1) * one.var(ddof=1) + (m - 1) * other.var(ddof=1)) / (n + m - 2))
    df = n + m - 2
    unbias = math.gamma(df / 2) / (math.sqrt(df / 2) * math.gamma((df - 1) / 2))
    g, interval = hedges_g(one, other)
    assert g == pytest.approx((other.mean() - one.mean()) / spread * unbias, **EXACT)
    # The bounds put the observed t at the edges of the noncentral t.
    scale = math.sqrt(1 / n + 1 / m)
    t = (other.mean() - one.mean()) / spread / scale
    for bound, share in zip(interval, (0.975, 0.025), strict=True):
        assert stats.nct.cdf(t, df, bound / unbias / scale) == pytest.approx(share, abs=1e-8)


@given(st.floats(0.1, 100.0), st.integers(1, 6), st.integers(20, 450))
def test_intervals_of_eta_squared_put_the_observed_f_at_the_edges(statistic, df1, df2):
    """Of the noncentral F, worked out as a Poisson mixture of central ones."""
    people, k = df1 + df2 + 1, np.arange(3000)
    below = stats.beta.cdf(df1 * statistic / (df1 * statistic + df2), df1 / 2 + k, df2 / 2)
    for bound, share in zip(FTest(statistic, df1, df2, people).interval, (0.95, 0.05), strict=True):
        found = (stats.poisson.pmf(k, bound / (1 - bound) * people / 2) * below).sum()
        assert found == pytest.approx(share, abs=1e-8) or (bound == 0 and found < share)


def test_mixtures_find_the_kinds_that_were_drawn():
    rng = np.random.default_rng(3)
    kind = rng.choice(2, 600, p=[0.62, 0.38])
    rates = np.where(kind == 0, rng.beta(38, 2, 600), rng.beta(5, 15, 600))
    visits = rng.choice([12, 24, 36, 48], 600)
    best = fit_mixtures(rng.binomial(visits, rates), visits)[0]
    assert len(best.shares) == 2
    assert best.shares == pytest.approx((0.62, 0.38), abs=0.06)
    assert best.means == pytest.approx((0.95, 0.25), abs=0.03)


def test_a_mixture_of_one_kind_is_a_beta_binomial():
    rng = np.random.default_rng(4)
    accepted = rng.binomial(24, rng.beta(6, 4, 300))
    fits = {len(m.shares): m for m in fit_mixtures(accepted, np.full(300, 24))}
    one = fits[1]
    a, b = one.means[0] * one.precisions[0], (1 - one.means[0]) * one.precisions[0]
    orders = sum(math.log(math.comb(24, k)) for k in accepted.tolist())
    expected = stats.betabinom.logpmf(accepted, 24, a, b).sum() - orders
    assert one.log_likelihood == pytest.approx(expected, **EXACT)
    assert one.bic == pytest.approx(2 * math.log(300) - 2 * expected, **EXACT)
    assert one.means[0] == pytest.approx(0.6, abs=0.05)
    assert fits[3].log_likelihood >= fits[2].log_likelihood - 1e-6 >= one.log_likelihood - 2e-6


@pytest.mark.parametrize(
    ("seed", "people", "kinds", "best"),
    [(0, 120, 3, -1269.75155), (1, 40, 2, -291.27696), (9, 40, 3, -310.69544), (13, 120, 3, -1107.30566)],
)
def test_mixtures_are_at_their_maximum(seed, people, kinds, best):
    """Of these people, climbs from three starts ended 0.01 to 0.5 below the best of 80."""
    rng = np.random.default_rng(seed)
    assert int(rng.choice([40, 120])) == people
    kind = rng.choice(3, people, p=[0.62, 0.2, 0.18])
    rates = (rng.beta(30, 1, people), rng.beta(2, 2, people), rng.beta(1, 9, people))
    visits = rng.choice([12, 24, 36, 48], people)
    fits = fit_mixtures(rng.binomial(visits, np.choose(kind, rates)), visits)
    assert next(m.log_likelihood for m in fits if len(m.shares) == kinds) > best - 1e-4


def test_the_ordinal_model_recovers_odds():
    rng = np.random.default_rng(6)
    cuts = [-1.5, -0.5, 0.5, 1.5]
    data = {
        name: 1.0 + np.searchsorted(cuts, rng.logistic(shift, 1, 1500))
        for name, shift in (("none", 0.0), ("highlight", 0.5), ("optimal", 1.0))
    }
    model = ordinal_model(data)
    assert model.odds_ratios["highlight"] == pytest.approx(math.exp(0.5), rel=0.2)
    assert model.odds_ratios["optimal"] == pytest.approx(math.exp(1.0), rel=0.2)
    assert model.test.df == 2


def test_two_answers_make_the_ordinal_model_a_logistic_one():
    """With two groups and two answers, the odds ratio is that of the table, and the test is its G test."""
    counts = np.array([[30, 20], [18, 34]])
    data = {"none": np.repeat([1.0, 2.0], counts[0]), "optimal": np.repeat([1.0, 2.0], counts[1])}
    model = ordinal_model(data)
    assert model.odds_ratios["optimal"] == pytest.approx((34 / 18) / (20 / 30), **EXACT)
    g = stats.chi2_contingency(counts, correction=False, lambda_="log-likelihood")
    assert model.test.statistic == pytest.approx(g.statistic, **EXACT)


@pytest.mark.parametrize("other", [[3.0] * 9, [3.0] * 5 + [4.0] * 4])
def test_odds_that_are_infinite_are_refused(other):
    """No answer of one group is as high as any answer of the other."""
    with pytest.raises(StatisticsError, match="a group gives none of the answers of another"):
        ordinal_model({"none": np.array([1.0] * 6 + [2.0] * 3), "optimal": np.array(other)})


def test_welchs_effect_size_lies_in_its_interval():
    """Both are of one noncentrality, however few degrees of freedom few people with a large variance leave."""
    for seed in range(50):
        rng = np.random.default_rng(seed)
        cases = zip("abc", (40, 40, 5), (0.0, 0.1, 0.3), (0.1, 0.1, 0.4), strict=True)
        found = welch({name: rng.normal(mean, spread, size) for name, size, mean, spread in cases})
        low, high = found.interval
        assert low <= found.eta_squared <= high
    assert brown_forsythe(groups()).as_json()["of"] == "variance of the distances from the medians"


@pytest.mark.parametrize("with_age", [False, True])
@pytest.mark.parametrize("spread", [0.8, 0.15, 0.0])
def test_the_mixed_model_by_dense_matrices(spread, with_age):
    """The likelihood at its maximum and Fai and Cornelius' F, written out with the covariance of all people."""
    rng = np.random.default_rng(int(100 * spread))
    house, first, second = rng.integers(0, 8, 90), rng.choice([*"abc"], 90), rng.choice([6, 12], 90)
    y = rng.normal(size=90) + rng.normal(0, spread, 8)[house] + 0.5 * (first == "c")
    cells = cells_of(y, first, second)
    columns = [block[cells.member] for block in cells.columns.values()]
    age = rng.normal(40.0, 9.0, 90)
    if with_age:
        scores = ((age - np.mean(age)) / np.std(age)).reshape(90, 1)
        columns += [scores, scores * cells.columns["assistance"][cells.member]]
    x, z, eye = np.hstack(columns), 1.0 * (house[:, None] == np.arange(8)), np.eye(90)
    parts = np.array([z @ z.T, eye])

    def projection(variances):
        inverse = np.linalg.inv(np.tensordot(variances, parts, 1))
        covariance = np.linalg.inv(x.T @ inverse @ x)
        return inverse - inverse @ x @ covariance @ x.T @ inverse, covariance, inverse

    model = mixed_model(y, first, second, {"house": house}, ("age", age) if with_age else None)
    assert list(model.tests)[3:] == ["age", "age x assistance"] * with_age
    assert (model.random["house"].interval is None) is with_age
    variances = np.array([model.random["house"].variance, model.residual_variance])
    p, covariance, inverse = projection(variances)
    slopes = [np.trace(p @ v) - y @ p @ v @ p @ y for v in parts]
    assert slopes[1] == pytest.approx(0, abs=1e-6)
    assert slopes[0] == pytest.approx(0, abs=1e-6) if variances[0] else slopes[0] > 0
    second_derivatives = [
        [y @ p @ v @ p @ w @ p @ y - np.trace(p @ v @ p @ w) / 2 for w in parts] for v in parts
    ]
    of_variances = (
        np.linalg.inv(second_derivatives)
        if variances[0]
        else np.diag([0, 2 * variances[1] ** 2 / (90 - x.shape[1])])
    )
    effects, start = covariance @ x.T @ inverse @ y, 1
    for test, block in zip(model.tests.values(), columns[1:], strict=True):
        rows = np.eye(x.shape[1])[start : start + block.shape[1]]
        start += len(rows)
        mine = rows @ covariance @ rows.T
        statistic = rows @ effects @ np.linalg.solve(mine, rows @ effects) / len(rows)
        sizes, turn = np.linalg.eigh(mine)
        freedom = []
        for size, row in zip(sizes, turn.T @ rows, strict=True):
            moved = inverse @ x @ covariance @ row
            gradient = np.array([moved @ v @ moved for v in parts])
            freedom.append(2 * size**2 / (gradient @ of_variances @ gradient))
        share = sum(one / (one - 2) for one in freedom)
        df2 = 2 * share / (share - len(rows)) if len(rows) > 1 else freedom[0]
        assert (test.statistic, test.df1) == (pytest.approx(statistic, rel=1e-6), len(rows))
        assert test.df2 == pytest.approx(df2, rel=1e-6)
        assert test.p == pytest.approx(stats.f.sf(statistic, len(rows), df2), rel=1e-6)


@pytest.mark.parametrize("spread", [0.8, 0.15, 0.0])
def test_the_ends_of_an_interval_of_a_share_are_as_unlikely_as_its_level_says(spread):
    """The profile of the restricted likelihood, written out with the covariance of all people."""
    rng = np.random.default_rng(int(100 * spread))
    house, condition = rng.integers(0, 12, 90), rng.choice([*"abc"], 90)
    y = rng.normal(size=90) + rng.normal(0, spread, 12)[house]
    x, z = 1.0 * (condition[:, None] == [*"abc"]), 1.0 * (house[:, None] == np.arange(12))

    def deviance(share):
        covariance = share * z @ z.T + (1 - share) * np.eye(90)
        inverse = np.linalg.inv(covariance)
        of_effects = x.T @ inverse @ x
        rest = y - x @ np.linalg.solve(of_effects, x.T @ inverse @ y)
        sizes = np.linalg.slogdet(covariance).logabsdet + np.linalg.slogdet(of_effects).logabsdet
        return sizes + 87 * math.log(rest @ inverse @ rest)

    found = mixed_model(y, condition, np.full(90, 6), {"house": house}).random["house"]
    (low, high), limit = found.interval, stats.chi2.ppf(0.95, 1)
    assert low <= found.share <= high < 1
    rises = [deviance(end) - deviance(found.share) for end in (low, high)]
    assert rises[1] == pytest.approx(limit, abs=1e-3)
    assert rises[0] == pytest.approx(limit, abs=1e-3) if low else rises[0] <= limit


@given(st.lists(st.floats(0.5, 1.9) | st.floats(2.1, 3.5) | st.floats(3.5, 200.0), min_size=2, max_size=6))
def test_the_joint_f_test_has_the_mean_of_its_parts(freedom):
    """By Fai and Cornelius, the mean of F is that of the squared t values, whose mean is df / (df - 2) above 2."""
    joint, values = variance_components._joint_freedom(np.array(freedom)), [v for v in freedom if v > 2.0]
    mean = sum(v / (v - 2.0) for v in values) / len(freedom)
    if max(freedom) - min(freedom) < 1e-6 * max(freedom):
        assert joint == pytest.approx(freedom[0], rel=1e-5)
    elif mean > 1.0:
        assert stats.f.mean(len(freedom), joint) == pytest.approx(mean, rel=1e-6)
    else:
        assert joint == 1.0, "too little is known of the variances"


def test_the_mixed_model_of_a_published_example():
    """Effort to rise from stools, by four stools and nine people (Pinheiro and Bates 2000, section 1.2)."""
    table = [[12, 15, 12, 10], [10, 14, 13, 12], [7, 14, 13, 9], [7, 11, 10, 9], [8, 11, 8, 7]]
    table += [[9, 11, 11, 10], [8, 12, 12, 11], [7, 11, 8, 7], [9, 13, 10, 8]]
    values, stools, people = np.array(table, float).ravel(), np.tile([*"abcd"], 9), np.repeat(np.arange(9), 4)
    model = mixed_model(values, stools, np.full(36, 6), {"person": people})
    test = model.tests["assistance"]
    assert (round(test.statistic, 4), test.df1, round(test.df2, 6)) == (22.3556, 3, 24)
    deviations = math.sqrt(model.random["person"].variance), math.sqrt(model.residual_variance)
    assert deviations == pytest.approx((1.332465, 1.100295), abs=5e-7)


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.0, 0.3, 0.7])
def test_the_interval_of_the_share_of_houses_holds_the_true_one(share):
    rng, held = np.random.default_rng(4), 0
    houses, condition = np.repeat(np.arange(20), 6), np.tile([*"ab"], 60)
    for _ in range(200):
        values = rng.normal(0, math.sqrt(share), 20)[houses] + rng.normal(0, math.sqrt(1 - share), 120)
        house = mixed_model(values, condition, np.full(120, 6), {"house": houses}).random["house"]
        low, high = house.interval
        assert 0 <= low <= house.share <= high <= 1
        held += low <= share <= high
    assert 0.91 <= held / 200 <= (1.0 if share == 0 else 0.99)


def test_a_house_that_explains_nearly_all_may_explain_all():
    rng = np.random.default_rng(0)
    houses, condition = np.repeat(np.arange(12), 6), np.tile([*"ab"], 36)
    values = rng.normal(0, 1.0, 12)[houses] + rng.normal(0, 1e-4, 72)
    house = mixed_model(values, condition, np.full(72, 6), {"house": houses}).random["house"]
    assert house.interval == pytest.approx((1.0, 1.0), abs=1e-5)


@pytest.mark.parametrize(
    ("people", "message"),
    [(8, "houses and cells are as many as people"), (80, "each cell has its own house")],
)
def test_houses_that_are_people_or_cells_are_refused(people, message):
    values = np.random.default_rng(0).normal(size=people)
    houses = np.arange(people) % 8
    with pytest.raises(StatisticsError, match=message):
        mixed_model(values, np.where(houses % 2, "a", "b"), houses // 2, {"house": houses})


@pytest.mark.parametrize("spread", [0.0, 3.0])
def test_the_interval_by_house_leaves_out_what_all_conditions_of_a_house_share(spread):
    """Where each house has one trial of each condition, it is as wide as that of the differences within houses."""
    rng, houses = np.random.default_rng(5), np.repeat(np.arange(60), 2)
    condition, values = np.tile([*"ab"], 60), rng.normal(size=120) + rng.normal(0, spread, 60)[houses]
    (found,) = differences_by_house(values, condition, np.full(120, 6), houses, ["a", "b"])
    pairs = values[1::2] - values[::2]
    assert found.difference == pytest.approx(pairs.mean())
    half = 1.96 * pairs.std() / math.sqrt(60)
    assert np.array(found.interval) == pytest.approx(pairs.mean() + np.array([-half, half]), abs=0.12 * half)
    with pytest.raises(StatisticsError, match="at least 5 houses; there are 2"):
        differences_by_house(values[:4], condition[:4], np.full(4, 6), houses[:4], ["a", "b"])


@pytest.mark.parametrize("houses", [4, 5])
def test_a_mixed_model_needs_five_levels_of_a_factor(houses):
    rng, house = np.random.default_rng(4), np.repeat(np.arange(houses), 20)
    condition, values = (
        np.tile([*"ab"], 10 * houses),
        rng.normal(size=20 * houses) + rng.normal(size=houses)[house],
    )
    if houses == 5:
        assert set(mixed_model(values, condition, np.full(100, 6), {"house": house}).random) == {"house"}
        return
    with pytest.raises(StatisticsError, match="at least 5 levels of house; there are 4"):
        mixed_model(values, condition, np.full(80, 6), {"house": house})


def test_factors_that_the_design_cannot_tell_apart_are_refused():
    rng, people = np.random.default_rng(0), np.repeat(np.arange(20), 4)
    condition, levels = np.tile([*"ab"], 40), np.full(80, 6)
    with pytest.raises(StatisticsError, match="cannot distinguish the variances of the random factors"):
        mixed_model(rng.normal(size=80), condition, levels, {"person": people, "house": people})


def test_a_factor_that_only_says_the_cell_is_refused_next_to_another_factor():
    rng, person = np.random.default_rng(1), np.repeat(np.arange(20), 6)
    condition, levels = np.tile([*"aabbcc"], 20), np.tile([6, 12], 60)
    cells = np.char.add(condition, levels.astype(str))
    with pytest.raises(StatisticsError, match="cannot distinguish the variances of the random factors"):
        mixed_model(rng.normal(size=120), condition, levels, {"person": person, "house": cells})


def test_a_constant_measure_and_people_who_do_not_differ_are_refused():
    houses, condition, levels = np.repeat(np.arange(10), 4), np.tile([*"ab"], 20), np.full(40, 6)
    with pytest.raises(StatisticsError, match="the values do not vary"):
        mixed_model(np.full(40, 3.7), condition, levels, {"house": houses})
    of_house = np.random.default_rng(2).normal(size=10)[houses]
    with pytest.raises(StatisticsError, match="in the same house and condition do not differ"):
        mixed_model(of_house + (condition == "b"), condition, levels, {"house": houses})


def test_a_mixed_model_of_many_houses_is_their_paired_t_test():
    """With a trial of each condition in each of 20,000 houses; dense indicators would take 6 GB."""
    rng, count = np.random.default_rng(3), 20_000
    houses, condition = np.repeat(np.arange(count), 2), np.tile([*"ab"], count)
    values = rng.normal(size=2 * count) + 0.7 * rng.normal(size=count)[houses] + 0.02 * (condition == "b")
    model = mixed_model(values, condition, np.full(2 * count, 6), {"house": houses})
    paired = stats.ttest_rel(values[1::2], values[::2])
    test = model.tests["assistance"]
    assert (test.statistic, test.df2) == (pytest.approx(paired.statistic**2), pytest.approx(count - 1))
    between = values.reshape(-1, 2).mean(axis=1).var(ddof=1)
    assert model.random["house"].variance == pytest.approx(between - model.residual_variance / 2)


@pytest.mark.parametrize("copied", [True, False])
def test_factors_with_as_many_levels_as_trials_or_the_same_ones_are_refused_at_once(copied):
    rows = np.arange(40_000)
    factors = {"person": rows // 2, "house": -(rows // 2)} if copied else {"house": rows}
    message = "cannot distinguish the variances" if copied else "houses and cells are as many as people"
    with pytest.raises(StatisticsError, match=message):
        mixed_model(np.random.default_rng(0).normal(size=len(rows)), rows % 2, np.full(len(rows), 6), factors)


@pytest.mark.slow
def test_sparse_crossproducts_give_the_model_of_dense_ones(monkeypatch):
    """Persons crossed with houses, and houses with conditions nested in houses."""
    rng = np.random.default_rng(0)
    person, house = rng.integers(0, 8, 120), rng.integers(0, 6, 120)
    condition, levels = rng.choice([*"abc"], 120), rng.choice([6, 12], 120)
    both = np.char.add(house.astype(str), condition)
    values = rng.normal(size=120) + rng.normal(size=8)[person] + rng.normal(size=6)[house]
    factors = {"person": person, "house": house, "house x assistance": both}

    def found():
        model = mixed_model(values, condition, levels, factors)
        tests = [(test.statistic, test.df2) for test in model.tests.values()]
        return np.ravel(tests), [factor.variance for factor in model.random.values()]

    dense = found()
    monkeypatch.setattr(variance_components, "DENSE", 0)
    for sparse, expected in zip(found(), dense, strict=True):
        assert sparse == pytest.approx(expected, rel=1e-7)


def test_power_by_simulation_and_its_inverse():
    eta_squared, per_cell = 0.1, 30
    shift = math.sqrt(eta_squared / (1 - eta_squared) * 3 / 2)
    values = np.random.default_rng(9).normal(size=(3, per_cell, 2000))
    values[0] -= shift
    values[2] += shift
    found = np.mean(stats.f_oneway(*values).pvalue < 0.05)
    power = power_of(eta_squared, 2, 87, 90)
    assert found == pytest.approx(power, abs=4 * math.sqrt(power * (1 - power) / 2000))
    assert detectable_eta_squared(2, 87, 90, power) == pytest.approx(eta_squared, rel=1e-6)
    assert people_per_cell(0.0177, 3, 12) == 51  # far above, noncentral F distributions underflow
    enough = people_per_cell(eta_squared, 2, 3)
    assert power_of(eta_squared, 2, 3 * (enough - 1), 3 * enough) >= 0.8
    assert power_of(eta_squared, 2, 3 * (enough - 2), 3 * (enough - 1)) < 0.8


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ({"a": np.arange(5.0)}, "only one group"),
        ({"a": np.ones(5), "b": np.zeros(5)}, "do not vary"),
        ({"a": np.ones(1), "b": np.zeros(1)}, "only one person"),
    ],
)
def test_groups_that_cannot_be_compared(data, message):
    for test in (one_way, lambda d: compare_pairs(d, 0.5)):
        with pytest.raises(StatisticsError, match=message):
            test(data)


def test_cells_that_cannot_be_compared():
    first, second = np.array(["a", "a", "b", "b"]), np.array([6, 12, 6, 12])
    with pytest.raises(StatisticsError, match="only one person"):
        two_way(np.arange(4.0), first, second)
    with pytest.raises(StatisticsError, match="no people in the cell b, 12"):
        two_way(np.arange(6.0), np.array([*"aaaabb"]), np.array([6, 6, 12, 12, 6, 6]))
    with pytest.raises(StatisticsError, match="do not vary"):
        two_way(np.repeat([1.0, 2.0, 3.0, 4.0], 3), np.repeat(first, 3), np.repeat(second, 3))
