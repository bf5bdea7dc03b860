"""People who differ: drawn by their seed, logged with every value, replayed to the bit."""

import dataclasses
import json
import math
import pickle
import shutil
from pathlib import Path

import numpy as np
import pytest
import scipy.stats
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from experiments.cli.main import main
from experiments.errors import ConfigError, ReplayError
from experiments.participants.distribution import Distribution, Distributions, distribution
from experiments.participants.follower import Follower
from experiments.participants.guest import PERSON
from experiments.record import records
from experiments.record.reader import read_run
from experiments.record.records import EventLog, read_events
from experiments.session.perception import SessionPercept
from experiments.trials.design import read_design
from experiments.trials.person import check_person, drawn_person
from experiments.trials.replay.replay import replay
from experiments.trials.setup import draw_person, prepare_session
from experiments.trials.trial import run_trial
from experiments.trials.trial_config import TrialConfig
from mjsim.house.scene.scene import compose
from mjsim.values.options import FIDELITIES
from mjsim.values.person_parameters import RANGES, PersonParameters

PEOPLE = """{
    walking_speed = {normal = [1.2, 0.2], min = 0.8}, reading_time = {lognormal = [1.35, 0.35]},
    reach = {uniform = [0.8, 1.1]}, field_of_view = 1.2, body_radius = 0.15,
    motion = {reach_time = {uniform = [0.3, 0.6]}},
}""".replace("\n", " ").replace(", }", "}")


@given(st.floats(0.001, 0.999), st.floats(0.5, 2.0), st.floats(0.05, 1.0))
def test_distributions_are_those_of_statistics(share, first, spread):
    """Against SciPy, which truncates likewise."""
    low, high = first * 0.7, first * 1.6
    normal = scipy.stats.truncnorm((low - first) / spread, (high - first) / spread, first, spread)
    uniform = scipy.stats.uniform(low, high - low)
    whole = scipy.stats.lognorm(spread, scale=first)
    below, above = whole.cdf(low), whole.cdf(high)
    for shape, second, expected in (
        ("normal", spread, normal.ppf(share)),
        ("lognormal", spread, whole.ppf(below + share * (above - below))),
        ("uniform", first + spread, min(high, max(low, uniform.ppf(share)))),
    ):
        start = low if shape == "uniform" else first
        end = high if shape == "uniform" else second
        assert Distribution(**{shape: (start, end)}).quantile(share, low, high) == pytest.approx(
            expected, rel=1e-6
        )


@pytest.mark.parametrize("scale", [1.0, 0.5, 8.0])
@pytest.mark.parametrize(
    ("share", "value"),
    [
        (0.0, 0.0),
        (0.125, 0.5),
        (0.2499, 0.9996),
        (0.2501, 5.0),
        (0.4999, 5.0),
        (0.5, 10.0),
        (0.75, 10.5),
        (1.0, 11.0),
    ],
)
def test_a_share_of_a_mixture_selects_a_component_by_its_weight_and_a_value_in_it(share, value, scale):
    """Weights count relative to their sum, and components without weight are never selected."""
    parts = [[0.25, {"uniform": [0.0, 1.0]}], [0.0, 7.0], [0.25, 5.0], [0.5, {"uniform": [10.0, 11.0]}]]
    spread = distribution("reach", {"mixture": [[scale * weight, part] for weight, part in parts]})
    assert spread.quantile(share) == pytest.approx(value, abs=1e-9)


@given(
    st.sampled_from(
        [
            {"normal": [1.2, 0.2]},
            {"lognormal": [1.35, 0.35], "min": 0.5},
            {"uniform": [1.0, 1.2]},
            {"beta": [0.5, 3.0], "max": 0.9},
            {"mixture": [[0.62, 1.0], [0.2, {"beta": [2, 2]}], [0.18, {"normal": [1.0, 0.1]}]]},
        ]
    ),
    st.lists(st.floats(0.0, 1.0) | st.sampled_from([0.0, 1.0]), min_size=2, max_size=6),
)
def test_every_share_has_a_finite_value_and_higher_shares_have_no_lower_ones(described, shares):
    spread = distribution("parameter", described)
    values = [spread.quantile(share) for share in sorted(shares)]
    assert all(map(math.isfinite, values))
    if "mixture" not in described:
        assert values == sorted(values)
    assert all(spread.min <= value <= spread.max for value in values)


@given(st.integers(0, 2**32))
def test_people_stay_within_their_limits_and_describing_more_changes_nothing_else(seed):
    def draw(**described):
        return drawn_person(Distributions.of(described), np.random.default_rng(seed))

    slow = {"normal": [1.2, 0.5], "min": 1.0, "max": 1.3}
    one, two = draw(walking_speed=slow), draw(walking_speed=slow, reach={"normal": [1.0, 9.0]})
    assert 1.0 <= one.walking_speed == two.walking_speed <= 1.3
    assert RANGES["reach"][0] <= two.reach <= RANGES["reach"][1]
    assert one == dataclasses.replace(PersonParameters(), walking_speed=one.walking_speed)


def test_guests_walk_at_the_speeds_that_were_measured_for_adults():
    """Means of comfortable walking speeds are 0.94 to 1.43 m/s (Bohannon and Williams Andrews 2011)."""
    guests = Distributions.of(PERSON)
    speeds = [drawn_person(guests, np.random.default_rng(seed)).walking_speed for seed in range(500)]
    assert 0.94 <= min(speeds) < 0.96 and 1.41 < max(speeds) <= 1.43
    assert np.mean(speeds) == pytest.approx(1.2, abs=0.02)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{walking_speed = -1}", r"walking_speed must be 0\.1 to 8 m/s, got -1"),
        ("{height = 1.8}", "a person has no 'height'; it has walking_speed"),
        ("{reach = {normal = [1.0]}}", r"reach: Expected `array` of length 2, got 1 - at `\$\.normal`"),
        ("{reach = {normal = [1.0, 0.0]}}", "reach: the standard deviation of normal must be positive"),
        ("{reach = {gamma = [1.0, 0.1]}}", "reach.gamma: Expected `float`, got `array`"),
        ("{reach = {normal = [1.0, 0.1], mean = 1.0}}", "reach: Object contains unknown field `mean`"),
        ("{reach = {mixture = [[-0.5, 1.0], [1.0, 1.1]]}}", "reach: Expected `float` >= 0.0"),
        ("{reach = {uniform = [1.1, 0.9]}}", "reach: uniform takes the lowest value, then the highest"),
        ("{reach = {normal = [9.0, 0.1]}}", r"reach: normal = .* has no values from 0\.6 to 1\.5"),
        ("{reach = {normal = [1.0, 0.1], min = 1.2, max = 1.1}}", "reach: min must not exceed max"),
        ("{reach = nan}", "reach: nan: every number must be finite"),
        ("{reach = 'far'}", "reach: Expected `float`, got `str`"),
        ("{motion = {lift_time = 9.0}}", r"motion\.lift_time must be 0\.1 to 3 .* got 9\.0"),
        ("{reach = ", "is not a description of people in TOML"),
        ("nobody.toml", "cannot read nobody.toml"),
    ],
)
def test_impossible_descriptions_are_named(text, message):
    with pytest.raises(ConfigError, match=message):
        check_person(Distributions.parse(text))


def test_a_description_comes_back_from_what_is_logged():
    people = Distributions.parse(PEOPLE)
    assert Distributions.of(json.loads(json.dumps(people.as_dict()))) == people


def test_a_design_says_who_takes_part(tmp_path):
    file = tmp_path / "design.toml"
    file.write_text(
        '[all_cells]\nobjects = 6\nassistance = "none"\nseeds = "0:2"\n'
        "[[cells]]\n[[cells]]\nseeds = [7]\nperson = {walking_speed = {normal = [1.2, 0.2]}}\n"
    )
    usual, _, other = read_design(file).trials
    assert draw_person(usual) == PersonParameters()
    assert other.person == Distributions.of({"walking_speed": {"normal": [1.2, 0.2]}})
    file.write_text(file.read_text().replace("walking_speed", "walking_pace"))
    with pytest.raises(ConfigError, match=r"line 8: cells\[1\].person: a person has no 'walking_pace'"):
        read_design(file)


def quick_follower(house, rng):  # noqa: ARG001 - as every factory
    return Follower(house)


quick_follower.person = {"walking_speed": {"uniform": [1.5, 1.6]}, "reading_time": 1.0}


def test_a_participant_says_how_it_differs_and_the_configuration_has_the_last_word():
    user = f"{__name__}:quick_follower"
    config = TrialConfig(objects=2, assistance="optimal", seed=0, user=user)
    slow = replace(config, person=Distributions.of({"reading_time": 2.0}))
    said, told = draw_person(config), draw_person(slow)
    assert 1.5 <= said.walking_speed == told.walking_speed <= 1.6
    assert (said.reading_time, told.reading_time) == (1.0, 2.0)


@pytest.fixture(scope="module", params=FIDELITIES)
def run(request, house, tmp_path_factory):
    """A trial of somebody who was drawn."""
    out: Path = tmp_path_factory.mktemp("people") / request.param
    people = Distributions.parse(PEOPLE)
    config = TrialConfig(objects=2, assistance="optimal", seed=5, fidelity=request.param, person=people)
    assert run_trial(config, out, topdown=False, house=house)["ended"] == "all delivered"
    return out


def test_every_value_that_was_drawn_is_logged_and_measured(run):
    start, participant = read_events(run / records.EVENTS)[:2]
    config = TrialConfig(objects=2, assistance="optimal", seed=5, person=Distributions.parse(PEOPLE))
    person = draw_person(config)
    assert PersonParameters.from_dict(participant["person"]) == person
    assert person.walking_speed != 1.2 and person.motion.reach_time != 0.44
    assert start["person"] == config.person.as_dict()
    metrics = json.loads((run / records.METRICS).read_text())
    assert {name: metrics[f"person_{name}"] for name in RANGES} == {
        name: getattr(person, name) for name in RANGES
    }


@pytest.mark.slow
def test_a_replay_is_of_the_person_that_was_logged(run, house, capsys):
    assert replay(run, house=house).person == read_run(run).person
    assert main(["replay", str(run)]) == 0
    shown = capsys.readouterr().out
    assert "field of view 1.2 rad" in shown and "eye height" not in shown


def test_a_replay_of_somebody_else_is_refused(run, house, tmp_path):
    """Whoever changes a value in the log is found out by its hash."""
    copy = shutil.copytree(run, tmp_path / "copy")
    log = copy / records.EVENTS
    log.write_text(log.read_text().replace('"field_of_view": 1.2,', '"field_of_view": 1.3,'))
    assert read_run(copy).person.field_of_view == 1.3
    with pytest.raises(ReplayError, match=r"first bad step (is )?0"):
        replay(copy, house=house)


def seconds_until_done(house, assistance="optimal", **values):
    config = TrialConfig(objects=2, assistance=assistance, seed=5, fidelity="event", regret=False)
    scene = compose(
        house.sample_episode(objects=2, seed=5), house.catalogue, person=PersonParameters(**values)
    )
    log = EventLog()
    prepare_session(config, house, scene, log)[0].run()
    return float(log.events[-1]["t"])


def test_who_reads_before_each_visit_or_walks_slowly_takes_longer(house):
    """Four visits; standing still beforehand costs or saves a fraction of a second each."""
    usual = seconds_until_done(house)
    assert seconds_until_done(house, reading_time=3.0) - usual == pytest.approx(4 * 3.0, abs=2.0)
    assert seconds_until_done(house, walking_speed=0.65) > 1.4 * usual


def test_who_looks_rarely_sees_later(house, monkeypatch):
    """Whoever searches asks for what is in view at every look."""
    looks, look = [], SessionPercept.look
    monkeypatch.setattr(SessionPercept, "look", lambda percept: looks.append(percept.time) or look(percept))
    seconds_until_done(house, "none", looking_interval=1.0)
    assert len(looks) > 5
    assert np.diff(np.unique(looks)).min() >= 1.0 - 1e-6


def test_a_description_is_the_same_in_another_process():
    """Batches recognize finished trials by it, and worker processes get it pickled."""
    described = {
        "reach": {"mixture": [[0.6, 1.0], [0.4, {"beta": [2.0, 2.0], "max": 0.9}]]},
        "reading_time": {"lognormal": [1.35, 0.35], "min": 0.5},
        "walking_speed": {"uniform": [1.0, 1.2]},
    }
    people = Distributions.of(described)
    assert pickle.loads(pickle.dumps(people)).as_dict() == people.as_dict() == described
    assert Distributions.of(people.as_dict()) == people
