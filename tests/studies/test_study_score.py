"""`mjsim study score`: published numbers, rows that agree and that do not, pools."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from msgspec import structs
from scipy import stats
from study_people import SIZES, made_up_people, table_of

from experiments.analysis.study.measures import read_measures
from experiments.cli.main import main
from experiments.errors import StatisticsError
from experiments.trials.table import write_tables
from studies import score_rules
from studies.prediction import log_score, prediction_interval
from studies.published import Direction, inconsistencies, read_published
from studies.score import DIRECTION, EFFECT_SIZE, INFERENCE, VARIANCE, score
from studies.score_files import how
from studies.score_population import draw
from studies.truth import true_studies

PUBLISHED = read_published()


@pytest.fixture(scope="module")
def people():
    return table_of(made_up_people())


@pytest.fixture(scope="module")
def pool():
    return table_of(made_up_people(dict.fromkeys(SIZES, 200), seed=5))


@pytest.fixture(scope="module", autouse=True)
def _few_truths():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("studies.score.TRUTHS", 3)
        yield


def rows_of(found, *kinds):
    return [r for r in found.rows if r.kind in kinds and r.ours != "not simulated"]


def test_degrees_of_freedom_are_those_of_the_design():
    for test in PUBLISHED.tests:
        cells = 3 if test.objects else 12
        assert test.df[1] == PUBLISHED.people_of(test.objects) - cells


def test_inconsistent_numbers_are_flagged():
    lines = inconsistencies(PUBLISHED)
    assert [line.partition(",")[0] for line in lines] == [
        "deviations",
        "deviations",
        "likert_need_to_follow",
        "likert_useful",
    ]
    assert "F(2,116) = 41.48" in lines[0]
    assert lines[1].endswith("printed p =.001, but F(6,435) = 2.865 gives p = .0095")
    assert lines[2].endswith("printed p =.000, but F(2,116) = 7.59 gives p = .0008")


def test_answers_stand_as_the_paper_prints_them():
    """*Usable* is "faster than with the help of the training"; control of speed is printed without a number."""
    tests = {t.measure: (t.statistic, t.p) for t in PUBLISHED.tests if t.measure.startswith("likert_")}
    assert tests == {
        "likert_control_what": (11.38, "=.000"),
        "likert_control_speed": (None, "n.s."),
        "likert_need_to_follow": (7.59, "=.000"),
        "likert_prefer_what": (15.56, "=.000"),
        "likert_useful": (7.83, "=.000"),
        "likert_faster": (12.72, "=.000"),
    }
    known = read_measures().likert
    assert all(name.removeprefix("likert_") in known for name in tests)
    pairs = {(d.measure, *d.pair, d.p) for d in PUBLISHED.directions if d.measure.startswith("likert_")}
    assert pairs == {
        ("likert_control_what", "optimal", "none", "<.001"),
        ("likert_control_what", "optimal", "highlight", "<.001"),
        ("likert_need_to_follow", "none", "optimal", "<.01"),
        ("likert_need_to_follow", "highlight", "optimal", "<.01"),
        ("likert_prefer_what", "none", "optimal", "<.001"),
        ("likert_prefer_what", "highlight", "optimal", "<.001"),
        ("likert_faster", "none", "optimal", "<.001"),
        ("likert_useful", "none", "optimal", "<.001"),
        ("likert_useful", "none", "highlight", "<.05"),
        ("likert_useful", "highlight", "optimal", "<.05"),
    }


def test_what_is_not_significant_bounds_the_effect():
    test = next(t for t in PUBLISHED.tests if t.p == "n.s." and t.effect == "objects")
    _, high = test.interval(447)
    critical = stats.f.ppf(0.95, 3, 435)
    assert high == pytest.approx(3 * critical / (3 * critical + 435), rel=1e-12)
    assert round(high, 3) == 0.018


def test_a_study_is_judged_by_its_own_tests(people):
    found = score(people, PUBLISHED)
    assert not found.pool
    assert found.as_published
    tests = {(t.measure, t.effect, t.objects): t for t in PUBLISHED.tests}
    for row in rows_of(found, INFERENCE):
        if row.objects is not None:
            ours = stats.f_oneway(*people.groups(row.measure, row.objects).values())
            assert row.ours.startswith(f"F(2,116) = {ours.statistic:.2f}")
            assert row.agrees == (
                (ours.pvalue < 0.05) == tests[row.measure, row.what, row.objects].significant
            )
    assert all(r.agrees for r in rows_of(found, VARIANCE))


def test_only_rows_at_6_objects_may_be_fitted_and_are_counted_apart(people):
    found = score(people, PUBLISHED)
    assert all(row.fitted == (row.objects == 6) for row in found.rows)
    assert [of for *_, of, _ in found.summary()] == [8, 12, 7, 5, 1, 3]


def test_answers_are_not_simulated(people):
    rows = [r for r in score(people, PUBLISHED).rows if r.measure.startswith("likert_")]
    assert len(rows) == 2 * 6 + 10, "six analyses of variance, ten of Tukey's tests"
    assert {(r.ours, r.agrees) for r in rows} == {("not simulated", None)}


def test_conditions_that_are_swapped_fail(people):
    """Whoever deviates most under optimal contradicts the directions and the variance orders."""
    swap = {"none": "optimal", "optimal": "none", "highlight": "highlight"}
    swapped = replace(people, assistance=np.array([swap[a] for a in people.assistance]))
    found = score(swapped, PUBLISHED)
    wrong = [r for r in rows_of(found, DIRECTION, VARIANCE) if not r.agrees]
    assert {r.what for r in wrong} >= {"optimal < none", "optimal lowest", "optimal > highlight > none"}
    assert not any(r.agrees for r in rows_of(found, VARIANCE))


def test_missing_cells_and_measures_say_so():
    rows = [r for r in made_up_people() if r["objects"] not in (6, 24) or r["assistance"] != "optimal"]
    for row in rows:
        del row["ipl_locations"]
    found = {(r.kind, r.measure, r.what, r.objects): r for r in score(table_of(rows), PUBLISHED).rows}
    assert found[INFERENCE, "ipl", "assistance", 6].remark == "ipl is not known"
    assert "no people in the cell optimal" in found[INFERENCE, "deviations", "assistance", None].remark
    assert found[DIRECTION, "deviations", "optimal < none", 6].agrees is None


def test_part_of_the_design_judges_nothing_about_all_of_it():
    """Deviations of these people rise from 6 to 12 objects; nothing is known of 18 and 24."""
    rows = score(table_of([r for r in made_up_people() if r["objects"] <= 12]), PUBLISHED).rows
    for row in rows:
        if row.measure.startswith("likert_"):
            continue
        assert (row.agrees is None) == (row.objects not in (6, 12)), row
        assert row.agrees is not None or row.remark == f"no people in the cell none, {row.objects or 18}"


def test_people_of_no_published_cell_are_refused():
    table = table_of(made_up_people({("none", 2): 3, ("optimal", 2): 3}))
    with pytest.raises(StatisticsError, match=r"no people in the cells .*\[6, 12, 18, 24\] objects"):
        score(table, PUBLISHED)


def test_studies_are_drawn_from_the_same_cells(pool):
    first, again = (list(draw(pool, PUBLISHED, seed=1, count=3)) for _ in range(2))
    for study, same in zip(first, again, strict=True):
        assert study.sizes() == SIZES
        assert study.columns["ipl"].tolist() == same.columns["ipl"].tolist()
    assert first[0].columns["ipl"].tolist() != first[1].columns["ipl"].tolist()
    own = set(pool.groups("ipl", 18)["highlight"].tolist())
    assert set(first[0].groups("ipl", 18)["highlight"].tolist()) <= own


@pytest.mark.slow
def test_a_pool_is_judged_as_a_population(pool):
    found = score(pool, PUBLISHED, seed=3)
    assert found.pool
    assert found == score(pool, PUBLISHED, seed=3)
    rows = {
        (r.kind, r.measure, r.what, r.objects): r for r in rows_of(found, INFERENCE, EFFECT_SIZE, DIRECTION)
    }
    null = rows[INFERENCE, "ipl", "objects", None]  # nothing depends on the number of objects
    assert null.agrees
    assert null.rate == pytest.approx(0.95, abs=0.06)
    assert rows[INFERENCE, "deviations", "assistance", 6].rate == 1.0
    assert all(0.0 <= r.rate <= 1.0 for r in rows.values())


@pytest.mark.slow
def test_the_score_command_writes_its_files_and_names_who_is_left_out(tmp_path, capsys):
    people = made_up_people()
    people[4]["ended"] = "time limit"
    write_tables(tmp_path, people)
    assert main(["study", "score", str(tmp_path)]) == 0
    assert capsys.readouterr().out.startswith("Simulated. A study of 446 people")
    found = json.loads((tmp_path / "analysis" / "score.json").read_text())
    assert (found["origin"], len(found["rows"]), len(found["inconsistent"])) == ("Simulated", 58, 4)
    assert [person["person"] for person in found["left_out"]] == ["4"]
    page = (tmp_path / "analysis" / "score.html").read_text()
    assert "http" not in page
    assert page.count('<p class="origin">Simulated</p>') == 7
    assert "<td>did not deliver everything</td>" in page
    assert main(["study", "score", str(tmp_path)]) == 2
    assert main(["study", "score", str(tmp_path), "--force", "--seed", "-1"]) == 2


def published(measure, effect, objects=None):
    return next(t for t in PUBLISHED.tests if (t.measure, t.effect, t.objects) == (measure, effect, objects))


@pytest.mark.slow
@pytest.mark.parametrize("eta_squared", [0.0, 0.05, 0.3])
def test_prediction_intervals_hold_nine_second_studies_in_ten(eta_squared):
    rng, people = np.random.default_rng(0), 119
    drawn = stats.ncf.rvs(
        2, 116, max(eta_squared / (1 - eta_squared) * people, 1e-9), size=(150, 2), random_state=rng
    )
    hits = 0
    for first, second in drawn:
        test = structs.replace(published("ipl", "assistance", 6), statistic=float(first), p="=.010")
        low, high = prediction_interval(test, people, 116.0, people)
        hits += low <= 2 * second / (2 * second + 116) <= high
    assert hits / 150 == pytest.approx(0.9, abs=3 * math.sqrt(0.09 / 150))


@pytest.mark.parametrize("people", [60, 176, 447])
@pytest.mark.parametrize("effect", ["objects", "interaction"])
def test_small_studies_without_an_effect_agree_with_none(people, effect):
    test = published("ipl", effect)
    df1, df2 = test.df[0], people - 12
    _, high = prediction_interval(test, 447, df2, people)
    statistic = high / (1 - high) * df2 / df1
    assert stats.f.cdf(statistic, df1, df2) > 0.95
    assert stats.ncf.cdf(statistic, df1, df2, 0.5 * people) < 0.2  # a large effect does not


def test_log_scores_have_the_truth_as_a_yardstick(people):
    """Studies with the published effects score about as the study that has them, and better than another one."""
    found = score(people, PUBLISHED)
    same = {**people.columns, "distance": np.random.default_rng(0).normal(size=len(people.rows))}
    assert len(found.log_truths) == 3 and max(found.log_truths) < 0
    assert min(found.log_truths) > score(replace(people, columns=same), PUBLISHED).log_score()
    low, high = np.quantile(found.log_truths, [0.05, 0.95])
    assert f"`the truth`: {low:.1f} to {high:.1f})" in how(found)


def test_log_scores_are_of_the_noncentral_f():
    test, null = published("ipl", "assistance"), published("ipl", "objects")
    noncentrality = 447 * 0.1
    likely, p = log_score(test, 447, np.array([0.1]))
    below = stats.ncf.cdf(30.71, 2, 435, noncentrality)
    assert (likely, p) == pytest.approx(
        (stats.ncf.logpdf(30.71, 2, 435, noncentrality), 2 * min(below, 1 - below)), rel=1e-8
    )
    chance = stats.ncf.cdf(stats.f.ppf(0.95, 3, 435), 3, 435, 4.47)
    assert log_score(null, 447, np.array([0.01])) == pytest.approx((math.log(chance), chance), rel=1e-8)


def test_the_truth_has_the_published_f_on_average(people):
    drawn = list(true_studies(people, PUBLISHED, 0, 60))
    for test in (t for t in PUBLISHED.tests if not t.measure.startswith("likert_")):
        found = [
            score_rules.tests_of(study, test.measure, test.objects)[test.effect].statistic for study in drawn
        ]
        expected = test.df[1] / (test.df[1] - 2) if test.statistic is None else test.statistic
        slack = 4 * np.std(found) / math.sqrt(60)
        # What is smaller than chance alone gives has no effect.
        assert np.mean(found) == pytest.approx(max(expected, 1.0), abs=slack)


def test_rises_are_trends_and_orders_are_shown_by_tukeys_test(people):
    """A step without a rise is no contradiction; means in order that chance explains are no order."""
    level = np.minimum(people.objects, 18)
    rng = np.random.default_rng(0)
    noise, optimal = rng.normal(0, 0.1, 447), people.assistance == "optimal"
    flat = replace(people, columns={"deviations": level / 20 + noise, "ipl": noise + 0.005 * optimal})
    rising, falling = Direction("deviations", rising="none"), Direction("ipl", falling=("optimal", "none"))
    assert score_rules.points(flat, rising)
    assert not score_rules.points(replace(flat, columns={"deviations": -level / 20 + noise}), rising)
    assert not score_rules.points(flat, falling)
    assert score_rules.points(replace(flat, columns={"ipl": noise + 0.1 * optimal}), falling)


def test_what_was_not_judged_is_not_called_wrong(tmp_path, capsys):
    write_tables(tmp_path, [r for r in made_up_people() if r["objects"] == 12])
    assert main(["study", "score", str(tmp_path)]) == 0
    shown = capsys.readouterr().out
    assert "effect sizes and inferences, fitted: none judged, 8 rows" in shown
    assert "0 of" not in shown
