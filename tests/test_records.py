"""Records: complete or absent, and never at the cost of something else."""

import json

import numpy as np
import pytest

from experiments.errors import RecordError
from experiments.records import EPISODE, EVENTS, EventLog, Trajectory, read_events, read_json, run_directory
from mjsim.actions import Move, Pick, Place
from mjsim.observation import ObjectStatus, Observation


def observation(time=0.0, hands=(None, "b")):
    return Observation(
        time=time,
        position=np.array([1.0, 2.0]),
        heading=0.5,
        pitch=-0.1,
        eye=np.array([1.0, 2.0, 1.6]),
        velocity=np.zeros(2),
        object_names=("a", "b"),
        object_positions=np.arange(6.0).reshape(2, 3),
        object_quaternions=np.tile([1.0, 0, 0, 0], (2, 1)),
        object_status=(ObjectStatus.LOOSE, ObjectStatus.CARRIED),
        hands=hands,
        busy=False,
    )


def fill(folder):
    (folder / EPISODE).write_text("{}")
    (folder / EVENTS).write_text("")


def test_a_run_directory_appears_whole(tmp_path):
    with run_directory(tmp_path / "run") as folder:
        fill(folder)
        assert not (tmp_path / "run").exists()
    assert (tmp_path / "run" / EPISODE).is_file()
    assert [p.name for p in tmp_path.iterdir()] == ["run"]


def test_a_failed_run_leaves_the_earlier_one_untouched(tmp_path):
    with run_directory(tmp_path / "run") as folder:
        fill(folder)
        (folder / "metrics.json").write_text("first")
    with pytest.raises(ZeroDivisionError), run_directory(tmp_path / "run") as folder:
        fill(folder)
        (folder / "metrics.json").write_text("second")
        raise ZeroDivisionError
    assert (tmp_path / "run" / "metrics.json").read_text() == "first"
    assert [p.name for p in tmp_path.iterdir()] == ["run"]


def test_a_run_replaces_an_earlier_run(tmp_path):
    for text in ("first", "second"):
        with run_directory(tmp_path / "run") as folder:
            fill(folder)
            (folder / "metrics.json").write_text(text)
    assert (tmp_path / "run" / "metrics.json").read_text() == "second"


def test_a_run_never_replaces_anything_else(tmp_path):
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "chapter.tex").write_text("precious")
    with pytest.raises(RecordError, match="thesis exists and is not a run"), run_directory(tmp_path / "thesis"):
        pass
    assert (tmp_path / "thesis" / "chapter.tex").read_text() == "precious"


def test_events_are_on_disk_as_soon_as_they_are_logged(tmp_path):
    with EventLog(tmp_path / "events.jsonl") as log:
        log.append(0.04, "picked", object="a")
        assert read_events(tmp_path / "events.jsonl") == [{"t": 0.04, "event": "picked", "object": "a"}]


def test_a_truncated_log_is_named_with_its_line(tmp_path):
    path = tmp_path / "events.jsonl"
    path.write_text(json.dumps({"t": 0, "event": "start"}) + '\n{"t": 1, "ev')
    with pytest.raises(RecordError, match=r"events\.jsonl, line 2 is not JSON"):
        read_events(path)


@pytest.mark.parametrize(("text", "fault"), [(None, "cannot read"), ("{", "is not JSON")])
def test_unreadable_json_is_named(tmp_path, text, fault):
    path = tmp_path / "metrics.json"
    if text is not None:
        path.write_text(text)
    with pytest.raises(RecordError, match=f"metrics.json.*{fault}|{fault}.*metrics.json"):
        read_json(path)


def test_a_trajectory_round_trips_and_repeats_byte_for_byte(tmp_path):
    actions = [Move(1.0, 0.1, -0.5, 0.2), Pick("b"), Place(None)]
    for name in ("one.npz", "two.npz"):
        trajectory = Trajectory(["a", "b"])
        for step, action in enumerate(actions):
            trajectory.append(observation(step * 0.04), action)
        trajectory.save(tmp_path / name)
    assert (tmp_path / "one.npz").read_bytes() == (tmp_path / "two.npz").read_bytes()
    arrays = np.load(tmp_path / "one.npz")
    assert arrays["time"].tolist() == [0.0, 0.04, 0.08]
    assert arrays["hands"].tolist() == [[-1, 1]] * 3
    assert arrays["object_status"].tolist() == [[0, 1]] * 3
    assert arrays["object_position"].shape == (3, 2, 3)
    assert arrays["action"].tolist() == [[0, -1, 1.0, 0.1, -0.5, 0.2], [1, 1, 0, 0, 0, 0], [2, -1, 0, 0, 0, 0]]


def test_an_empty_trajectory_still_saves(tmp_path):
    Trajectory(["a"]).save(tmp_path / "t.npz")
    assert np.load(tmp_path / "t.npz")["time"].shape == (0,)
