"""A batch knows what it ran: what changed is run again, what is there is in the tables, and nothing is mistaken."""

import dataclasses
import json
import shutil
import sys

import pytest

from experiments.errors import ConfigError, RecordError, SessionError, UserCodeError
from experiments.house import House
from experiments.participants.distribution import Distributions
from experiments.record import records
from experiments.trials.batch import run_batch
from experiments.trials.batch_folder import read_trial, trial_name
from experiments.trials.batch_plan import check_trials, plan_batch
from experiments.trials.design import Design, confounded, factorial
from experiments.trials.fingerprint import plugin_digest, trial_inputs
from experiments.trials.trial import run_trial
from experiments.trials.trial_config import TrialConfig
from experiments.trials.trial_reader import TrialReader
from hud.errors import ConditionError
from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.scene import sampling
from mjsim.values.errors import AssetError, EpisodeError, SamplingError
from planner.errors import PlannerError


def brief(**options):
    same = {"objects": 1, "assistance": "none", "seed": 0, "fidelity": "event", "regret": False}
    return TrialConfig(**{**same, "time_limit": 0.2, **options})


def run_missing(trials, out, house=None):
    """What `run_batch` does, in this process; returns how many trials were run, and the notes."""
    plan = plan_batch(trials, check_trials(trials), out)
    for path, config in plan.missing.items():
        run_trial(config, path, topdown=False, replace=True, house=house)
    return len(plan.missing), plan.notes


def write_participant(folder, text):
    """A participant in a package with a module that it imports; `text` is in the latter."""
    package = folder / "own_person"
    package.mkdir(exist_ok=True)
    (package / "__init__.py").write_text("from own_person.helper import build\n")
    (package / "helper.py").write_text(f"{text}\nfrom experiments.participants.searcher import build\n")
    for module in ("own_person", "own_person.helper"):
        sys.modules.pop(module, None)
    plugin_digest.cache_clear()  # as in another process


def test_what_is_there_is_not_run_again(house, tmp_path):
    trials = [brief(), brief(seed=1)]
    assert run_missing(trials, tmp_path, house) == (2, ())
    assert run_missing(trials, tmp_path, house) == (0, ())
    assert run_missing([*trials, brief(user="searcher")], tmp_path, house) == (1, ())
    assert {t.settings["user"] for t in TrialReader(tmp_path).read()[0]} == {"follower", "searcher"}


def test_an_edited_participant_is_run_again_and_the_old_trial_is_kept(house, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(tmp_path))
    write_participant(tmp_path, "A = 1")
    trials = [brief(user="own_person:build"), brief()]
    run_missing(trials, tmp_path / "b", house)
    write_participant(tmp_path, "A = 2")  # in a module that the participant imports
    count, (note,) = run_missing(trials, tmp_path / "b", house)
    assert count == 1
    assert note.startswith("run again: 1 trial:") and "module own_person changed" in note
    assert [read_trial(path).settings["user"] for path in (tmp_path / "b/outdated").iterdir()] == [
        "own_person:build"
    ]
    assert len(TrialReader(tmp_path / "b").read()[0]) == 2


def copy_of(small_house, folder, **replaced):
    """A copy of the small house whose catalogue names its models relative to itself."""
    shutil.copytree(small_house, folder)
    for file in folder.iterdir():
        text = file.read_text().replace(f"{small_house}/", "")
        for old, new in replaced.items():
            text = text.replace(old, new)
        file.write_text(text)
    return str(folder / "catalogue.toml")


def test_houses_whose_folders_share_a_name_are_not_mistaken(small_house, tmp_path):
    one = copy_of(small_house, tmp_path / "one/home")
    other = copy_of(small_house, tmp_path / "other/home", Small="Tiny")
    trials = [brief(house=name, points=4) for name in (one, other)]
    assert run_missing(trials[:1], tmp_path / "b") == (1, ())
    assert run_missing(trials[1:], tmp_path / "b") == (1, ())
    assert run_missing(trials, tmp_path / "b") == (0, ())
    assert {t.settings["house"] for t in TrialReader(tmp_path / "b").read()[0]} == {one, other}


def test_a_moved_house_is_the_same_and_an_edited_one_is_not(small_house, tmp_path):
    home, moved = (copy_of(small_house, tmp_path / name) for name in ("home", "moved"))
    assert run_missing([brief(house=home, points=4)], tmp_path / "b") == (1, ())
    assert run_missing([brief(house=moved, points=4)], tmp_path / "b") == (0, ())
    cube, ball = (tmp_path / "home" / name for name in ("cube.xml", "ball.xml"))
    texts = cube.read_text(), ball.read_text()
    for path, text in zip(
        (ball, cube), texts, strict=True
    ):  # the files together hold the same bytes as before
        path.write_text(text)
    count, (note,) = run_missing([brief(house=home, points=4)], tmp_path / "b")
    assert count == 1 and "run again: 1 trial: house changed (1);" in note


def test_an_episode_of_another_house_is_named_before_the_first_trial(house, small_house, tmp_path):
    house.sample_episode(objects=1, seed=0).save(tmp_path / "episode.json")
    trial = brief(house=str(small_house / "catalogue.toml"), episode=str(tmp_path / "episode.json"))
    with pytest.raises(EpisodeError, match=r"episode\.json: "):
        check_trials([trial])


def test_forged_metrics_are_noticed_and_not_copied(house, tmp_path):
    run_missing([brief()], tmp_path, house)
    (path,) = (tmp_path / "trials").iterdir()
    metrics = json.loads((path / records.METRICS).read_text())
    (path / records.METRICS).write_text(json.dumps({**metrics, "house_seed": 77, "delivered": 9}))
    trial = read_trial(path)
    assert not trial.as_measured
    assert (trial.row["house_seed"], trial.row["delivered"]) == (0, 0)
    (path / records.METRICS).write_text("[1]")
    assert read_trial(path).row["house_seed"] == 0


@pytest.mark.parametrize("name", [records.EVENTS, records.TRAJECTORY, records.EPISODE])
def test_a_damaged_record_is_run_again(house, tmp_path, name):
    run_missing([brief()], tmp_path, house)
    (path,) = (tmp_path / "trials").iterdir()
    content = (path / name).read_bytes()
    (path / name).write_bytes(content.replace(b"0", b"1", 1))
    with pytest.raises(RecordError, match="is not as written"):
        read_trial(path)
    count, (note,) = run_missing([brief()], tmp_path, house)
    assert count == 1 and f"{name} is not as written" in note


def test_an_interrupted_trial_is_run_again(house, tmp_path):
    def interrupt(_):
        raise KeyboardInterrupt

    (path,) = plan_batch([brief()], check_trials([brief()]), tmp_path).missing
    run_trial(brief(), path, topdown=False, house=house, on_progress=interrupt)
    count, (note,) = run_missing([brief()], tmp_path, house)
    assert count == 1 and "ended early, interrupted (1)" in note
    assert not (tmp_path / "outdated").exists()  # nothing complete was replaced


def test_unlike_trials_have_unlike_names():
    trials = [*factorial(objects=[6, 12], assistance=["none"], users=["follower"], seeds=range(3)).trials]
    trials += [brief(user=user) for user in ("a:b.c", "a.b:c", "boltzmann:1", "boltzmann:1.0")]
    trials += [brief(**{name: 5}) for name in ("house_seed", "person_seed", "order_seed", "points")]
    others = {"planner": "greedy", "capacity": 1, "fidelity": "full", "user": "a:" + "b" * 300}
    trials += [brief(**{name: value}) for name, value in others.items()]
    names = {trial_name(trial, {}) for trial in trials}
    assert len(names) == len(trials)
    assert all("/" not in name and ":" not in name and len(name) < 200 for name in names)


@pytest.mark.parametrize(
    ("options", "error", "fault"),
    [
        ({"assistance": "optimla"}, ConditionError, "no assistance condition 'optimla'"),
        ({"assistance": "optimal-xray-xray"}, ConditionError, "names an option twice"),
        ({"user": "ghost"}, ConfigError, "no participant 'ghost'"),
        ({"user": "no_such_module:build"}, ConfigError, "current folder"),
        ({"user": "math:pi"}, ConfigError, "is a float"),
        ({"planner": "oracle"}, PlannerError, "unknown solver 'oracle'"),
        ({"planner": "math:sqrt"}, PlannerError, "cannot make the planner"),
        ({"planner": "collections:Counter"}, PlannerError, "no method solve"),
        ({"house": "castle"}, AssetError, "no house 'castle'"),
        ({"episode": "/nowhere/episode.json"}, EpisodeError, "cannot read episode"),
        (
            {"user": "nearest"},
            SessionError,
            r"needs \['flagpole'\] markers but the assistance condition shows none",
        ),
        ({"assistance": "builtins:id"}, UserCodeError, "must return a HudState"),
        ({"user": "builtins:max"}, UserCodeError, "participant 'builtins:max' raised TypeError"),
    ],
)
def test_everything_is_checked_before_the_first_trial(options, error, fault, tmp_path):
    with pytest.raises(error, match=fault):
        run_batch(Design((brief(), brief(seed=1, **options))), tmp_path / "b", workers=1)
    assert list(tmp_path.iterdir()) == []


def test_a_reach_too_short_for_one_of_many_people_is_named_before_the_first_trial(house, monkeypatch):
    bin_ = house.receptacles["office_box"]
    farther = dataclasses.replace(bin_, center=bin_.center + 0.3 * bin_.rotation[:, 1])
    wide = dataclasses.replace(house, receptacles={**house.receptacles, "office_box": farther})
    monkeypatch.setattr(House, "load", lambda _: wide)
    people = Distributions.of({"reach": {"uniform": [0.6, 1.0]}})
    with pytest.raises(ConfigError, match="m is too short for 'office_box'"):
        check_trials([brief(seed=seed, person=people) for seed in range(8)])
    check_trials([brief(person=Distributions.of({"reach": 1.2, "body_radius": 0.22}))])


def test_participants_who_are_shown_what_they_need_pass():
    check_trials([brief(user="nearest", assistance="highlight"), brief(user="boltzmann:2"), brief()])


def test_a_house_too_small_for_the_points_is_named_before_the_first_trial(small_house, monkeypatch):
    monkeypatch.setattr(sampling, "PACKINGS", 1)
    trial = brief(house=str(small_house / "catalogue.toml"))
    with pytest.raises(SamplingError, match=r"of 40 points fit.*--points"):
        check_trials([trial])


def test_equal_trials_have_equal_inputs_and_code_is_one_of_them():
    inputs = trial_inputs(brief(), Catalogue.load())
    assert inputs == trial_inputs(brief(seed=3), Catalogue.load())
    assert {"house", "code of mjsim", "mujoco", "numpy", "python"} <= set(inputs)


def test_confounding_is_named_with_all_that_differs():
    trials = [brief(assistance="none", user="searcher"), brief(assistance="optimal", points=20)]
    fault = confounded(trials)
    assert "user (none: searcher, optimal: follower)" in fault and "points (none: 40, optimal: 20)" in fault
    balanced = factorial(
        objects=[1], assistance=["none", "optimal"], users=["follower", "searcher"], seeds=[0]
    )
    assert confounded(balanced.trials) is None


def test_what_is_confounded_in_the_design_and_in_the_folder_is_said_once(tmp_path, monkeypatch):
    design = Design((brief(assistance="none", user="searcher"), brief(assistance="optimal")))
    monkeypatch.setattr("experiments.trials.batch._run_missing", lambda *_: None)
    monkeypatch.setattr(
        "experiments.trials.batch_folder.folder_notes", lambda *_: [confounded(design.trials)]
    )
    notes = []
    run_batch(design, tmp_path / "out", workers=1, on_note=notes.append)
    assert notes == [confounded(design.trials)]
