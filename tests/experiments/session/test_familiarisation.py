"""What comes before the task: story, fly-through and training, and what simulated participants know afterwards."""

import dataclasses
import itertools
import math
import re
from collections import Counter

import av
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sessions import prepared

from experiments.cli.main import main
from experiments.errors import ConfigError, ReplayError
from experiments.participants.distribution import Distributions
from experiments.record.metrics import measure
from experiments.record.phases import PHASES
from experiments.record.records import read_events
from experiments.session.camera_path import BIN_TIME, SPEED, STEP, TURNING, bins_seen, camera_path
from experiments.session.familiarise import reading_time, story_text, with_names
from experiments.session.film import write_flythrough
from experiments.session.film_config import FilmConfig
from experiments.trials.design import read_design
from experiments.trials.replay.replay import replay
from experiments.trials.setup import simulated_user
from experiments.trials.training import training_config
from experiments.trials.trial import run_trial
from experiments.trials.trial_config import TrialConfig
from experiments.visit.texts import languages, story_file
from mjsim.house.compiled.house import compiled_house
from mjsim.house.sight.sight import FieldOfView, visible_receptacles
from mjsim.render import CameraPose, Renderer
from mjsim.values.person_parameters import PersonParameters

SMALL = FilmConfig(320, 240, "draft")
FIELD = FieldOfView.of(PersonParameters())
SESSION = "story,flythrough,training,task"


@pytest.fixture(scope="module")
def path(house):
    return camera_path(house)


@pytest.fixture(scope="module")
def session(house, tmp_path_factory):
    """A whole session of a participant who sees no farther than 1.6 m."""
    out = tmp_path_factory.mktemp("session") / "run"
    person = Distributions.of({"viewing_distance": 1.6})
    config = TrialConfig(
        objects=2,
        assistance="optimal",
        training_assistance="optimal",  # without help, the short-sighted search for longer than a training lasts
        seed=3,
        fidelity="event",
        phases=SESSION,
        person=person,
    )
    run_trial(config, out, topdown=False, house=house)
    return out


# The camera


def test_the_camera_enters_every_room_and_rests_on_every_bin(house, path):
    rooms = {house.rooms.room_at(position[:2]) for position in path.positions[::10]}
    assert rooms == set(house.catalogue.rooms)
    for key, bin_ in house.receptacles.items():
        row = [i for i, looked_at in enumerate(path.bins) if looked_at == key][25]
        offset = bin_.center - path.positions[row]
        assert abs(math.remainder(math.atan2(offset[1], offset[0]) - path.headings[row], math.tau)) < 0.05
        assert abs(math.atan2(offset[2], math.hypot(*offset[:2])) - path.pitches[row]) < 0.05


def test_the_camera_turns_once_around_in_each_room_and_shows_its_bins_before_the_next_room(house, path):
    first = path.bins[: round(math.tau / TURNING / STEP)]
    assert set(first) == {None}
    assert path.headings[: len(first) - 20] == pytest.approx(
        TURNING * STEP * np.arange(1, len(first) - 19), abs=0.15
    )
    assert np.abs(path.pitches[: len(first) - 20]).max() < 1e-6
    shown = [key for key, _ in itertools.groupby(path.bins) if key is not None]
    assert sorted(shown) == sorted(house.receptacles)
    assert {path.bins.count(key) for key in shown} == {round(BIN_TIME / STEP)}
    rooms = [room for room, _ in itertools.groupby(house.catalogue.receptacles[key].room for key in shown)]
    assert len(rooms) == len(set(rooms))
    for points in house.viewpoints.values():
        here = np.linalg.norm(path.positions[:, :2] - points[0], axis=1) < 0.1
        assert np.ptp(path.headings[here]) > 1.8 * math.pi


def test_the_camera_moves_smoothly_where_a_person_can_walk(house, path):
    steps = np.linalg.norm(np.diff(path.positions[:, :2], axis=0), axis=1)
    assert steps.max() <= SPEED * STEP * 1.001
    assert np.abs(np.diff(path.headings)).max() / STEP < math.radians(150.0)
    gaps = [np.linalg.norm(house.navmesh.snap(xy) - xy) for xy in path.positions[::5, :2]]
    assert max(gaps) < 0.2  # of the 0.25 m that paths keep from walls
    assert set(path.positions[:, 2]) == {PersonParameters().eye_height}


def test_a_walking_camera_looks_ahead_along_its_way(path):
    """In curves the gaze leads the step, but it never turns away from it."""
    steps = np.diff(path.positions[:, :2], axis=0)
    walks = np.linalg.norm(steps, axis=1) > 0.98 * SPEED * STEP
    away = np.arctan2(steps[:, 1], steps[:, 0]) - path.headings[:-1]
    assert walks.sum() > 100
    assert np.median(np.cos(away[walks])) > 0.99 and np.cos(away[walks]).min() > 0.0


@pytest.mark.slow
def test_what_rays_see_of_the_bins_is_what_the_picture_shows(house, path):
    compiled = compiled_house(house.catalogue)
    model, data = compiled.model, compiled.data
    owner = np.array([model.body(int(body)).name.split("/")[0] for body in model.geom_bodyid])
    seen = set()
    with Renderer(model, width=320, height=240, profile="draft") as renderer:
        for row in range(0, len(path.headings), 40):
            heading, pitch, eye = float(path.headings[row]), float(path.pitches[row]), path.positions[row]
            gaze = [math.cos(heading) * math.cos(pitch), math.sin(heading) * math.cos(pitch), math.sin(pitch)]
            ids = renderer.segmentation(
                data, CameraPose.looking_at(eye, eye + np.array(gaze), FIELD.vertical)
            )
            pixels = Counter(owner[ids[ids >= 0]].tolist())
            found = visible_receptacles(model, data, house.receptacles, eye, heading, pitch, field=FIELD)
            assert all(pixels[key] > 0 for key in found), row
            assert all(pixels[key] <= 3000 for key in set(house.receptacles) - found), row
            seen |= found
    assert seen == set(house.receptacles)


@pytest.mark.slow
@settings(max_examples=10)
@given(near=st.floats(0.5, 8.0), narrow=st.floats(0.2, 2.0))
def test_who_sees_farther_and_wider_sees_no_less(house, path, near, narrow):
    few = bins_seen(house, path, FieldOfView(narrow, 0.75 * narrow, near), 0.4)
    many = bins_seen(house, path, FieldOfView(narrow * 1.2, 0.9 * narrow, near + 1.0), 0.4)
    assert set(few) <= set(many)
    assert all(many[key] <= time for key, time in few.items())


# The film


@pytest.mark.slow
def test_the_film_repeats_and_has_the_length_that_was_asked_for(house, tmp_path):
    hashes = {write_flythrough(house, tmp_path / f"{i}.mp4", SMALL, seconds=1.6) for i in range(2)}
    assert len(hashes) == 1
    with av.open(str(tmp_path / "0.mp4")) as film:
        assert sum(1 for _ in film.decode(video=0)) == 40


def test_the_command_keeps_what_is_there(tmp_path, capsys):
    there = tmp_path / "film.mp4"
    there.write_text("notes")
    assert main(["flythrough", "--out", str(there)]) == 2
    assert "--force" in capsys.readouterr().err
    assert there.read_text() == "notes"
    small = ["--seconds", "1", "--size", "320x240", "--profile", "draft"]
    assert main(["flythrough", "--out", str(there), "--force", *small]) == 0
    assert there.stat().st_size > 1000
    assert main(["flythrough", "--out", str(tmp_path / "film.avi")]) == 2
    assert main(["flythrough", "--out", str(tmp_path / "short.mp4"), "--seconds", "0.5"]) == 2


# The phases of a trial


@pytest.mark.parametrize("text", ["", "story", "task,story", "task,task", "video,task"])
def test_other_phases_are_refused_in_one_line(text):
    with pytest.raises(ConfigError) as error:
        TrialConfig(objects=1, assistance="none", seed=0, phases=text)
    assert "\n" not in str(error.value)


def test_a_story_of_ones_own_is_read(tmp_path):
    story = tmp_path / "story.txt"
    story.write_text("Tidy up. " * 119)
    assert reading_time(story_text(story)) == 60.0
    with pytest.raises(ConfigError, match="the phases lack story"):
        TrialConfig(objects=1, assistance="none", seed=0, story=str(story))
    with pytest.raises(ConfigError, match="cannot read the story"):
        story_text(tmp_path / "missing")
    assert len(story_text().split()) > 50


@pytest.mark.parametrize("language", languages())
def test_the_story_names_the_bins_of_the_house_and_no_others(language, house):
    """A home may have fewer bins than the apartment; the words are those of the lists on the display."""
    everything = house.catalogue.in_language(language)
    kept = {k: c for k, c in everything.categories.items() if k in ("dishes", "laundry")}
    bins = {c.receptacle: everything.receptacles[c.receptacle] for c in kept.values()}
    fewer = dataclasses.replace(everything, categories=kept, receptacles=bins)
    for catalogue in (everything, fewer):
        text = with_names(story_text(story_file(language)), catalogue)
        for entries in ("categories", "receptacles"):
            labels = {entry.label.lower() for entry in getattr(everything, entries).values()}
            expected = {entry.label.lower() for entry in getattr(catalogue, entries).values()}
            assert {label for label in labels if label in text.lower()} == expected
        assert re.search(rf"\b{len(catalogue.receptacles)}\b", text) and "{" not in text


def test_the_story_of_the_apartment_takes_as_long_to_read_as_ever(house):
    assert reading_time(with_names(story_text(), house.catalogue)) == pytest.approx(60.0 * 106 / 238.0)


def test_a_design_names_phases(tmp_path):
    design = tmp_path / "design.toml"
    design.write_text(
        '[all_cells]\nphases = ["flythrough", "task"]\n[[cells]]\nobjects = 6\nassistance = "none"\npeople = 2\n'
    )
    assert {trial.phases for trial in read_design(design).trials} == {"flythrough,task"}


def test_the_training_is_a_trial_of_one_object_with_the_same_person():
    config = TrialConfig(objects=24, assistance="highlight", seed=5, phases=SESSION, fidelity="event")
    training = training_config(config)
    assert (training.objects, training.phases) == (1, "task")
    assert training.person_seed == config.person_seed
    assert training.house_seed != config.house_seed
    assert training == training_config(config)


def test_everybody_has_the_same_training_whatever_the_task_shows():
    """The item "faster than with the help of the training" compares with one and the same help."""

    def shown(assistance, **options):
        config = TrialConfig(objects=6, assistance=assistance, seed=5, phases=SESSION, **options)
        return training_config(config).assistance

    conditions = ("none", "highlight", "optimal", "guided-minimap")
    assert {shown(name) for name in conditions} == {"none"}
    assert {shown(name, training_assistance="highlight") for name in conditions} == {"highlight"}
    with pytest.raises(ConfigError, match="the phases lack training"):
        TrialConfig(objects=6, assistance="none", seed=5, training_assistance="highlight")


def test_a_session_logs_its_phases_and_a_trial_without_them_logs_none(session, house, tmp_path):
    events = read_events(session / "events.jsonl")
    ended = {event["phase"]: event for event in events if event["event"] == "phase_ended"}
    assert tuple(ended) == PHASES[:-1]
    assert 0 < len(ended["flythrough"]["bins"]) < 6
    assert ended["training"]["reason"] == "all delivered"
    row = measure(events, dict(np.load(session / "trajectory.npz")))
    assert row["completion_over_familiarisation"] == events[-1]["t"] / ended["flythrough"]["duration_s"]
    config = TrialConfig(objects=1, assistance="optimal", seed=3, fidelity="event")
    run_trial(config, tmp_path / "run", topdown=False, house=house)
    assert "phase" not in {event["event"][:5] for event in read_events(tmp_path / "run" / "events.jsonl")}


def test_a_replay_verifies_a_session_with_its_training(session, house):
    report = replay(session, house=house)
    assert [v.file for v in report.verdicts if not v.verified] == []
    assert "training" in [verdict.file for verdict in report.verdicts]


def test_a_replay_works_out_anew_what_was_seen(session, house, monkeypatch):
    monkeypatch.setattr(
        "experiments.trials.replay.comparison.watch_flythrough",
        lambda *_: {"phase": "flythrough", "bins": {}},
    )
    with pytest.raises(ReplayError, match="bins of the flythrough"):
        replay(session, house=house)


def test_a_session_takes_the_place_of_one_before_only_with_force(tmp_path):
    words = ["run", "--objects", "1", "--fidelity", "event", "--no-video", "--no-floor-plan"]
    words += ["--phases", "training,task", "--training-assistance", "optimal", "--time-limit", "1"]
    words += ["--out", str(tmp_path / "run")]
    assert main(words) == 0
    assert main(words) == 2
    assert main([*words, "--force"]) == 0
    (tmp_path / "run" / "training" / "events.jsonl").unlink()  # no run of ours any more
    assert main([*words, "--force"]) == 2


# What participants know


@pytest.mark.slow
@pytest.mark.parametrize(("user", "assistance"), [("searcher", "none"), ("nearest", "highlight")])
def test_bins_that_were_not_seen_are_searched_for(house, user, assistance, step_singly):
    """They are found, no sooner, and the run is the same in single steps. Whoever saw all knows the house."""
    config = TrialConfig(objects=3, assistance=assistance, seed=5, fidelity="event", user=user, regret=False)
    nothing, everything = frozenset(), frozenset(house.receptacles)
    walks = {seen: _run(config, house, seen) for seen in (None, nothing, everything)}
    assert walks[nothing][0] == walks[None][0] == "all delivered"
    assert walks[nothing][1] > walks[None][1]
    assert walks[everything] == walks[None]
    assert _run(config, house, nothing, step_singly) == walks[nothing]


def _run(config, house, seen, prepare=lambda _: None):
    """Why a session ended, its last time, and a hash of its last state."""
    user = simulated_user(config, dataclasses.replace(house, seen=seen))
    session, world, log = prepared(house, config, user=user)
    prepare(world)
    reason = session.run()
    hashes = session.record.record().recording["state_hash"]
    return reason, float(log.events[-1]["t"]), int(np.bitwise_xor.reduce(hashes))
