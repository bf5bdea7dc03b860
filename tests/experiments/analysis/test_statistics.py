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

from experiments.analysis.statistics.anova import brown_forsythe, one_way, two_way, welch
from experiments.analysis.statistics.effects import FTest, hedges_g
from experiments.analysis.statistics.mixtures import fit_mixtures
from experiments.analysis.statistics.models import mixed_model, ordinal_model
from experiments.analysis.statistics.pairs import compare_pairs, holm, tukey_differs
from experiments.analysis.statistics.power import detectable_eta_squared, people_per_cell, power_of
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
        (brown_forsythe, 40, functools.partial(stats.levene, center="median")),
    ],
)
def test_one_factor_is_analysed_as_by_scipy(test, smallest, expected):
    data = groups(sizes=(smallest, 37, 42))
    found, peer = test(data), expected(*data.values())
    assert (found.df1, found.people) == (2, smallest + 79)
    assert test is welch or found.df2 == smallest + 76
    assert (found.statistic, found.p) == pytest.approx((peer.statistic, peer.pvalue), **EXACT)
    share = 2 * found.statistic / (2 * found.statistic + found.df2)
    assert found.eta_squared == pytest.approx(share, **EXACT)


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


def test_holm_of_a_worked_example():
    """Smallest times 4, next times 3, and so on, never falling (by hand)."""
    assert holm(np.array([0.01, 0.04, 0.03, 0.005])) == pytest.approx([0.03, 0.06, 0.06, 0.02])


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
    assert fits[3].log_likelihood >= fits[2].log_likelihood - 1e-3 >= one.log_likelihood - 2e-3


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
    assert model.odds_ratios["optimal"] == pytest.approx((34 / 18) / (20 / 30), rel=1e-4)
    g = stats.chi2_contingency(counts, correction=False, lambda_="log-likelihood")
    assert model.test.statistic == pytest.approx(g.statistic, rel=1e-6)


def test_the_mixed_model_of_a_balanced_design_is_the_textbook_one():
    """Balanced houses: variances are those of the analysis of variance, and the effect its generalised t."""
    rng, houses, each = np.random.default_rng(8), 24, 12
    house = np.repeat(np.arange(houses), each)
    assistance = np.tile(np.repeat(["none", "optimal"], each // 2), houses)
    values = (
        rng.normal(size=houses * each) + rng.normal(0, 0.8, houses)[house] + 0.4 * (assistance == "optimal")
    )
    table = values.reshape(houses, 2, each // 2)
    effect = table[:, 1].mean() - table[:, 0].mean()
    between = each * table.mean(axis=(1, 2)).var(ddof=1)
    left = table - table.mean(axis=(1, 2), keepdims=True) - np.array([-effect / 2, effect / 2])[:, None]
    residual = (left**2).sum() / (houses * each - houses - 1)
    model = mixed_model(values, assistance, np.full(houses * each, 6), house)
    assert model.residual_variance == pytest.approx(residual, rel=1e-4)
    assert model.house_variance == pytest.approx((between - residual) / each, rel=1e-3)
    expected = effect**2 / (residual * 4 / (houses * each))
    assert model.tests["assistance"].statistic == pytest.approx(expected, rel=1e-3)


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
    enough = people_per_cell(eta_squared, 2, 3)
    assert power_of(eta_squared, 2, 3 * (enough - 1), 3 * enough) >= 0.8
    assert power_of(eta_squared, 2, 3 * (enough - 2), 3 * (enough - 1)) < 0.8


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ({"a": np.arange(5.0)}, "only one group"),
        ({"a": np.ones(5), "b": np.zeros(5)}, "do not vary"),
        ({"a": np.ones(1), "b": np.zeros(1)}, "one person only"),
    ],
)
def test_groups_that_cannot_be_compared(data, message):
    for test in (one_way, lambda d: compare_pairs(d, 0.5)):
        with pytest.raises(StatisticsError, match=message):
            test(data)


def test_cells_that_cannot_be_compared():
    first, second = np.array(["a", "a", "b", "b"]), np.array([6, 12, 6, 12])
    with pytest.raises(StatisticsError, match="one person only"):
        two_way(np.arange(4.0), first, second)
    with pytest.raises(StatisticsError, match="no people in the cell b, 12"):
        two_way(np.arange(6.0), np.array([*"aaaabb"]), np.array([6, 6, 12, 12, 6, 6]))
    with pytest.raises(StatisticsError, match="do not vary"):
        two_way(np.repeat([1.0, 2.0, 3.0, 4.0], 3), np.repeat(first, 3), np.repeat(second, 3))
