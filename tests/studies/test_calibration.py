"""The calibration: its surrogate against known people, its rows against the score, its parameters against the truth."""

import json

import numpy as np
import pytest
from msgspec.structs import replace
from study_people import table_of

from experiments.cli.main import main
from experiments.errors import ConfigError, RecordError, StatisticsError
from experiments.participants.distribution import Distributions, distribution
from experiments.participants.guest import PARAMETERS
from experiments.record.phases import SIMULATED
from experiments.trials.design import read_design
from experiments.trials.designs import read_study, study_path
from experiments.trials.table import write_tables
from studies import score_rules
from studies.calibration import inference, surrogate
from studies.calibration.calibrate import calibrate, fitted_study
from studies.calibration.files import FILES
from studies.calibration.inference import Outcome, Rows, missed_orders, population_effects, sample_effects
from studies.calibration.population import FreeParameters, read_free_parameters, stratified_shares
from studies.calibration.surrogate import learn, ridge
from studies.controls import read_controls
from studies.published import read_published
from studies.score_population import population_eta_squared

ROWS = Rows.of(read_published())
SIZES = np.array(list(ROWS.sizes.values()), float)
CONDITIONS = tuple(ROWS.sizes)


# The surrogate


def test_what_is_left_of_a_person_is_what_a_fit_without_it_misses(monkeypatch):
    """Leaving out one person after the other, by brute force, at the same penalty."""
    monkeypatch.setattr(surrogate, "PENALTIES", np.array([3.0]))
    rng = np.random.default_rng(0)
    terms = np.column_stack([np.ones(25), rng.normal(size=(25, 6))])
    outcome = rng.normal(size=25)
    _, left_out = ridge(terms, outcome)
    penalty = np.diag([0.0] + [3.0] * 6)
    for k in range(25):
        kept = np.arange(25) != k
        # The penalty is on slopes from the centre of everybody, which a shift of the terms does not change.
        a, b = terms[kept], outcome[kept]
        slopes = np.linalg.solve(a.T @ a + penalty, a.T @ b)
        assert left_out[k] == pytest.approx(outcome[k] - terms[k] @ slopes, rel=1e-9, abs=1e-12)


def known(people, rng):
    """Two measures: one that follows from the values, with noise that grows; one that is chance alone."""
    first = 2.0 + 3.0 * people[:, 0] - 2.0 * people[:, 0] * people[:, 1]
    return np.column_stack(
        [first + (0.2 + 0.8 * people[:, 2]) * rng.normal(size=len(people)), rng.normal(size=len(people))]
    )


def test_the_surrogate_knows_means_and_variances_of_people_it_has_not_seen():
    rng = np.random.default_rng(1)
    pool = rng.random((600, 4))
    found = learn(pool, known(pool, rng))
    assert found.left_out_r2[0] > 0.4
    assert found.left_out_r2[1] < 0.05
    for low, high in ((0.0, 0.4), (0.5, 1.0), (0.2, 0.3)):
        others = rng.uniform(low, high, (4000, 4))
        mean, variance = found.moments(others)
        truth = known(others, rng)
        assert mean == pytest.approx(truth.mean(axis=0), abs=0.15)
        assert variance == pytest.approx(truth.var(axis=0), rel=0.4)


def test_too_few_people_teach_nothing():
    with pytest.raises(StatisticsError, match="10 people are too few"):
        learn(np.zeros((10, 2)), np.zeros((10, 1)))
    with pytest.raises(StatisticsError, match="does not vary"):
        learn(np.random.default_rng(0).random((50, 2)), np.zeros((50, 1)))


# The rows


def person(condition, values, **given):
    """A row of the table of people: values of the measured columns, and other ones that are given."""
    columns = ("nd_feasible", "ipl_locations", "task_distance_m", "completion_time_s")
    measured = dict(zip(columns, values.tolist(), strict=True))
    return {"assistance": condition, "objects": 6, "user": "guest", **given, **measured}


def study(seed, sizes=ROWS.sizes):
    """People of one study at 6 objects, and its cells' means and variances, (1, measures, conditions) each."""
    rng = np.random.default_rng(seed)
    rows = [
        person(
            condition, rng.normal([0.6 - 0.05 * k, 0.5 + 0.025 * k, 300 - 15 * k, 600], [0.05, 0.05, 30, 60])
        )
        for k, (condition, count) in enumerate(sizes.items())
        for _ in range(count)
    ]
    table = table_of(rows)
    cells = [[table.groups(m, 6)[c] for c in CONDITIONS] for m in ROWS.measures()]
    moments = [
        np.array([[f(v) for v in cell] for cell in cells])[None] for f in (np.mean, lambda v: v.var(ddof=1))
    ]
    return table, Outcome(*moments)


@pytest.mark.parametrize("seed", range(5))
def test_effects_and_orders_of_a_study_are_those_of_its_score(seed):
    table, outcome = study(seed)
    effects = sample_effects(outcome, SIZES)[0]
    for k, test in enumerate(ROWS.tests):
        expected = score_rules.tests_of(table, test.measure, 6)["assistance"].eta_squared
        assert effects[k] == pytest.approx(expected, rel=1e-8)
    missed = missed_orders(outcome, ROWS)[0]
    for direction, one in zip(ROWS.directions, missed, strict=False):
        assert one == (not score_rules.points(table, direction))


def test_effects_of_populations_are_those_of_large_pools():
    table, outcome = study(3, dict.fromkeys(ROWS.sizes, 5_000))
    found = population_effects(outcome, SIZES)[0]
    steps = {"deviations": -1.0, "ipl": 0.5, "distance": -0.5, "time": 0.0}  # in standard deviations
    places = np.arange(3) - SIZES @ np.arange(3) / SIZES.sum()
    for k, test in enumerate(ROWS.tests):
        noncentrality = steps[test.measure] ** 2 * (SIZES @ places**2)
        assert found[k] == pytest.approx(noncentrality / (noncentrality + SIZES.sum()), abs=0.01)
        assert found[k] == pytest.approx(population_eta_squared(table, read_published(), test), abs=1e-3)


def test_only_rows_at_6_objects_are_looked_at():
    assert {test.objects for test in ROWS.tests} == {6}
    assert {direction.objects for direction in ROWS.directions} == {6}
    assert (len(ROWS.tests), len(ROWS.orders())) == (4, 8)


# Free parameters


@pytest.fixture(scope="module")
def pool_trials():
    return read_study(study_path("pool")).trials


def test_the_committed_parameters_describe_guests_within_the_pool(pool_trials):
    free, rng = read_free_parameters(), np.random.default_rng(0)
    assert set(free.inputs()) <= set(PARAMETERS)
    shares = stratified_shares(64, len(free.inputs()), rng)
    for draw in free.draw(20, rng):
        people = free.people(draw, shares)
        for name, column in zip(free.inputs(), people.T, strict=True):
            assert PARAMETERS[name].lowest <= column.min() <= column.max() <= PARAMETERS[name].highest
    assert set(free.inputs()) == set(pool_trials[0].behaviour)


def test_people_are_spread_over_each_distribution_and_inputs_are_not_tied():
    free = FreeParameters(
        {"middle": distribution("middle", 3.0)}, {"a.b": {"normal": ["middle", 1.0]}, "c.d": {"beta": [2, 2]}}
    )
    people = free.people(np.array([3.0]), stratified_shares(2000, 2, np.random.default_rng(0)))
    assert people.mean(axis=0) == pytest.approx([3.0, 0.5], abs=0.01)
    assert people.std(axis=0) == pytest.approx([1.0, np.sqrt(1 / 20)], rel=0.02)
    assert abs(np.corrcoef(people.T)[0, 1]) < 0.1


def test_a_name_that_is_no_free_parameter_is_named():
    free = FreeParameters({"a": distribution("a", 1.0)}, {"x.y": "b"})
    with pytest.raises(ConfigError, match="no free parameter 'b'; there are a"):
        free.inputs()


# All of it


TRUTH = {"share": 0.35, "idle": 0.5}
FREE = FreeParameters(
    {name: distribution(name, {"uniform": [0.05, 0.95]}) for name in TRUTH},
    {"compliance.follows": {"beta": ["share", 0.6]}, "timing.words": "idle"},
)


def pool(count=250, seed=0):
    """People of whom only `follows` counts, and that under `optimal` alone."""
    rng, rows = np.random.default_rng(seed), []
    for condition in CONDITIONS:
        for _ in range(count):
            follows, words = rng.random(2).tolist()
            away = 1 - follows if condition == "optimal" else 1.0
            means, spreads = [0.3 + 0.4 * away, 0.9 - 0.2 * away, 60 + 20 * away, 200], [0.08, 0.1, 12, 50]
            given = {"behaviour_compliance_follows": follows, "behaviour_timing_words": words}
            rows.append(person(condition, rng.normal(means, spreads), **given))
    return rows


@pytest.mark.slow
def test_what_counts_is_identified_and_what_does_not_is_not(monkeypatch):
    monkeypatch.setattr(inference, "KEPT", 0.05)
    found = calibrate([table_of(pool())], FREE, read_published(), draws=800, seed=0)
    contraction = dict(zip(TRUTH, found.fit.contraction().tolist(), strict=True))
    assert contraction["share"] > 0.5 > 0.4 > abs(contraction["idle"])
    sensitivity = found.fit.sensitivity()
    # Nothing of either is in the times.
    assert abs(sensitivity[0, 0]) > 0.9 > 0.4 > abs(sensitivity[1, :3]).max()
    assert len(found.fit.kept) == 40
    again = calibrate([table_of(pool())], FREE, read_published(), draws=800, seed=0)
    assert np.array_equal(again.fit.distance, found.fit.distance)


def test_a_fitted_study_is_read_back_with_its_population(tmp_path):
    behaviour = read_free_parameters().behaviour(read_free_parameters().draw(1, np.random.default_rng(0))[0])
    rounded = Distributions.of(behaviour.as_dict())
    plain = tmp_path / "plain.toml"
    plain.write_text('[all_cells]\nuser = "guest"\nassistance = "none"\nobjects = 6\n[[cells]]\npeople = 2\n')
    path = tmp_path / "fitted.toml"
    path.write_text(fitted_study(plain, rounded, "here"))
    found = dict(read_design(path).trials[0].behaviour)
    assert set(found) == set(rounded)
    for name, described in rounded.items():
        shares = [0.1, 0.5, 0.9]
        expected = [described.quantile(s, -np.inf, np.inf) for s in shares]
        assert [found[name].quantile(s, -np.inf, np.inf) for s in shares] == pytest.approx(expected, rel=5e-3)
    path.write_text(fitted_study(path, rounded, "again"))
    assert path.read_text().count("# Fitted") == 1
    own = tmp_path / "own.toml"
    own.write_text(plain.read_text() + "[all_cells.behaviour]\ntiming.words = 3\n")
    with pytest.raises(RecordError, match="a population of its own"):
        fitted_study(own, rounded, "here")


@pytest.mark.slow
def test_the_command_writes_files_that_say_simulated(tmp_path):
    rng = np.random.default_rng(0)
    inputs = read_free_parameters().inputs()
    rows = [
        {**row, **{f"behaviour_{name.replace('.', '_')}": float(rng.random()) for name in inputs}}
        for row in pool(60)
    ]
    rows[4]["ended"] = "time limit"
    write_tables(tmp_path, rows)
    assert main(["study", "calibrate", str(tmp_path), "--draws", "200"]) == 0
    folder = tmp_path / "calibration"
    assert sorted(path.name for path in folder.iterdir()) == sorted(FILES)
    page = (folder / "calibration.html").read_text()
    assert SIMULATED in page and "<td>did not deliver everything</td>" in page
    assert SIMULATED in (folder / "kept.csv").read_text().splitlines()[1]
    found = json.loads((folder / "calibration.json").read_text())
    assert len(found["left_out"]) == 1
    assert found["origin"] == SIMULATED and len(found["parameters"]) == len(read_free_parameters().priors)
    assert len(read_study(folder / "study.toml").trials) == 447
    assert main(["study", "calibrate", str(tmp_path), "--draws", "200"]) == 2
    assert main(["study", "calibrate", str(tmp_path), "--draws", "3", "--force"]) == 2


# Studies and their controls


def test_controls_change_what_they_name_and_leave_the_rest_of_the_population():
    design = read_study(study_path("paper"), 24)
    given = Distributions.of({"compliance.follows": 0.5, "timing.guided_step": 9.0})
    design = type(design)(tuple(replace(t, behaviour=given) for t in design.trials))
    controls = {control.name: control.design.trials for control in read_controls(design)}
    (trial, *_) = controls["everyone-complies"]
    obedient = {"compliance.follows": 1.0, "compliance.quits": 0.0}
    assert trial.behaviour.as_dict() == given.as_dict() | obedient
    assert all(not t.behaviour for t in controls["follower"])
    assert {t.assistance for t in controls["nearest"]} == {"highlight"}
    assert all(len(trials) == 24 for name, trials in controls.items() if name != "nearest")


def test_pool_and_study_are_of_one_house_and_share_nobody(pool_trials):
    paper = read_study(study_path("paper")).trials
    assert {t.house_seed for t in pool_trials} == {t.house_seed for t in paper} == {57}
    assert not {t.person_seed for t in pool_trials} & {t.person_seed for t in paper}
