"""Designs with their own cells, and what one seed of three decides."""

from pathlib import Path

import pytest
from sessions import prepared

from experiments.errors import ConfigError
from experiments.trials.design import numbers, read_design
from experiments.trials.designs import read_study, study_path
from experiments.trials.setup import trial_episode
from experiments.trials.trial_config import TrialConfig

EXAMPLES = Path(__file__).parents[3] / "docs" / "designs"


def design(tmp_path, text):
    path = tmp_path / "design.toml"
    path.write_text(text)
    return read_design(path).trials


def test_cells_may_be_of_unlike_size_and_share_what_all_have(tmp_path):
    trials = design(
        tmp_path,
        """
        [all_cells]
        fidelity = "event"
        house_seeds = 7

        [[cells]]
        assistance = "none"
        objects = 6
        people = 3

        [[cells]]
        assistance = "optimal"
        objects = 12
        fidelity = "full"
        person_seeds = "10:13"
        house_seeds = [4, 9]
        """,
    )
    cells = [("none", 6, "event")] * 3 + [("optimal", 12, "full")] * 3
    assert [(t.assistance, t.objects, t.fidelity) for t in trials] == cells
    assert [t.house_seed for t in trials] == [7, 7, 7, 4, 9, 4]  # gone through again
    people = [(0, 0), (1, 1), (2, 2), (10, 0), (11, 1), (12, 2)]
    assert [(t.person_seed, t.order_seed) for t in trials] == people


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("", "missing required field `cells`"),
        ("[[cells]]\nobjects = 6", r"line 1: cells\[0\]: people or seeds are missing"),
        ("[[cells]]\npeople = 2", r"line 1: cells\[0\]: missing required field `objects`"),
        ('[[cells]]\npeople = "2"', r"line 2: cells\[0\].people is '2'; expected `int \| null`, got `str`"),
        ("[[cells]]\nasistance = 'none'", "unknown field `asistance`"),
        ("[[cells]]\npeople = 0", "expected `int` >= 1"),
        ("[[cells]]\nobjects = 6\nassistance = 'none'\npeople = 2\nseeds = '0:3'", "seeds for 3"),
        ("[[cells]]\nobjects = 6\nassistance = 'none'\nseeds = '0:99999999999'", "more than 1000000"),
        ("[[cells]]\nobjects = 6\nassistance = 'none'\nseeds = [-1]", "or one below 0"),
        ("[[cells]]\nobjects = 6\nassistance = 'none'\npeople = 1\nhouses = []", "houses is empty"),
        ("[[cells]]\nobjects = 60\nassistance = 'none'\nseeds = 1", "objects is 60; it must be 1 to 40"),
        (
            "[[cells]]\nobjects = 6\nassistance = 'none'\npeople = 1\nperson = 'x'",
            "'x' is not a table of values",
        ),
        (
            "[[cells]]\nobjects = 6\nassistance = 'none'\npeople = 1\nperson = { a = {} }",
            "a is an empty table",
        ),
        (
            "[[cells]]\nobjects = 6\nassistance = 'none'\npeople = 1\nbehaviour = [1]",
            "is not a table of values",
        ),
        (
            "[[cells]]\nobjects = 6\nassistance = 'none'\nperson_seeds = [1, 1]\nhouse_seeds = 0\norder_seeds = 0",
            "2 times",
        ),
    ],
)
def test_an_unusable_design_is_named_with_the_path_of_the_value(tmp_path, text, fault):
    with pytest.raises(ConfigError, match=fault):
        design(tmp_path, text)


def test_a_file_that_cannot_be_read_is_named(tmp_path):
    with pytest.raises(ConfigError, match="cannot read design"):
        read_design(tmp_path / "none.toml")


def test_a_byte_order_mark_is_no_fault(tmp_path):
    """Some editors begin UTF-8 with one."""
    text = "[[cells]]\nobjects = 6\nassistance = 'none'\nseeds = 1\n"
    assert design(tmp_path, "\ufeff" + text) == design(tmp_path, text)


def test_the_documented_designs_are_designs():
    counts = {path.name: len(read_design(path).trials) for path in EXAMPLES.glob("*.toml")}
    assert counts == {"two_houses.toml": 24}
    assert len(read_design(study_path("paper")).trials) == 447


def test_a_folder_does_not_hide_a_study_of_the_package_and_a_file_does(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "paper").mkdir()  # as after `mjsim study simulate paper --out paper`
    (tmp_path / "pool").write_text("")
    assert study_path("paper").name == "paper.toml"
    assert study_path("pool") == Path("pool")
    with pytest.raises(ConfigError, match="no study 'papers'; give the path of a design file, or `paper`"):
        study_path("papers")


def test_an_own_episode_and_house_are_found_beside_the_design(tmp_path, house):
    house.sample_episode(objects=2, seed=5).save(tmp_path / "mine.json")
    cell = "[[cells]]\nassistance = 'none'\npeople = 2\nepisode = 'mine.json'\n"
    for trial in design(tmp_path, cell):
        assert (trial.objects, trial.house, trial.house_seed) == (2, "apartment", 5)
        assert trial_episode(trial, house) == house.sample_episode(objects=2, seed=5)
    with pytest.raises(ConfigError, match="leave out objects"):
        design(tmp_path, cell + "objects = 2")


@pytest.mark.parametrize(("text", "values"), [(3, [3]), ("0:2,7", [0, 1, 7]), ([4, 4], [4, 4])])
def test_numbers(text, values):
    assert numbers(text) == values


def start_of(house, **seeds):
    config = TrialConfig(objects=6, assistance="none", time_limit=2.0, regret=False, **seeds)
    return prepared(house, config)[2].events[0]


def test_each_seed_decides_one_thing(house):
    same = start_of(house, seed=3)
    assert (same["house_seed"], same["person_seed"], same["order_seed"]) == (3, 3, 3)
    other_house = start_of(house, seed=3, house_seed=4)
    other_order = start_of(house, seed=3, order_seed=4)
    other_person = start_of(house, seed=3, person_seed=4)
    assert other_house["episode_sha256"] != same["episode_sha256"]
    assert (other_house["order"], other_house["person_seed"]) == (same["order"], 3)
    assert other_order["episode_sha256"] == same["episode_sha256"]
    assert other_order["order"] != same["order"]
    assert other_person["episode_sha256"] == same["episode_sha256"]
    assert other_person["order"] == same["order"]
    assert len({e["fingerprint"] for e in (same, other_house, other_order, other_person)}) == 4


def test_the_person_seed_reaches_the_participant(house, monkeypatch):
    drawn = []
    monkeypatch.setattr(
        "experiments.trials.setup.make_participant",
        lambda _name, _house, rng, _behaviour: drawn.append(rng.random()),
    )
    for seeds in ({}, {"house_seed": 9, "order_seed": 9}, {"person_seed": 9}):
        start_of(house, **{"seed": 1, **seeds})
    assert drawn[0] == drawn[1] != drawn[2]


@pytest.mark.parametrize(
    ("options", "fault"),
    [
        ({}, "needs a seed, or each of house_seed, person_seed, order_seed"),
        ({"seed": 2**63}, "seed is 9223372036854775808; it must be 0 to"),
        ({"seed": -1}, "seed is -1; it must be 0 to"),
        ({"seed": 0, "time_limit": 0.0}, "time_limit is 0.0 s"),
        ({"seed": 0, "order_seed": -2}, "order_seed is -2"),
        ({"seed": 0, "time_limit": float("nan")}, "time_limit is nan s"),
        ({"seed": 0, "capacity": 3}, "capacity is 3"),
        ({"seed": 0, "points": 0}, "points is 0"),
        ({"seed": 0, "objects": 12, "points": 6}, "objects is 12; it must be 1 to 6"),
        (
            {"seed": 0, "field_of_view_range": "1.9,1.2"},
            "field_of_view_range is '1.9,1.2'; it must be two angles",
        ),
        ({"seed": 0, "field_of_view_range": "70,110"}, "from 0.3491 to 2.618 rad"),
        ({"seed": 0, "field_of_view_range": "1.2"}, "such as 1.2,1.9"),
    ],
)
def test_unusable_configurations(options, fault):
    with pytest.raises(ConfigError, match=fault):
        TrialConfig(**{"objects": 6, "assistance": "none", **options})


def test_trials_of_a_person_are_in_homes_that_come_as_often_first_as_last(tmp_path):
    cell = "[[cells]]\nobjects = 4\nassistance = 'none'\nhouse_seeds = 0\nhouses = 'generated:0:8'\nseeds = '{}'\n{}"
    trials = design(tmp_path, cell.format("0:8", "trials_per_person = 4"))
    assert [trial.trial_number for trial in trials] == [1, 2, 3, 4] * 8
    assert all(len({t.house for t in trials if t.person_seed == person}) == 4 for person in range(8))
    assert len({(trial.house, trial.trial_number) for trial in trials}) == 32
    assert len(design(tmp_path, cell.format("0:2", "trials_per_person = 4"))) == 8
    some = read_study(tmp_path / "design.toml", 1).trials
    assert {t.house for t in some} == {t.house for t in trials if t.person_seed == 0}
    with pytest.raises(
        ConfigError, match="trials_per_person is 9; give each trial its own house or house seed"
    ):
        design(tmp_path, cell.format("0:8", "trials_per_person = 9"))
