"""Records: complete or absent, and never at the cost of something else."""

import dataclasses
import hashlib
import json
import math
from concurrent.futures import Future

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.errors import RecordError
from experiments.files import read_json
from experiments.runs.records import EPISODE, EVENTS, METRICS, EventLog, read_events
from experiments.runs.run_directory import run_directory
from experiments.runs.trajectory import Trajectory, decode_action
from mjsim.actions import Move, Pick, Place
from mjsim.health.values import HealthSample
from mjsim.observation import ObjectStatus, Observation
from mjsim.rollout import Rollout


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
    (folder / METRICS).write_text("{}")


def test_a_run_directory_appears_whole(tmp_path):
    with run_directory(tmp_path / "run") as folder:
        fill(folder)
        assert not (tmp_path / "run").exists()
    assert (tmp_path / "run" / EPISODE).is_file()
    assert [p.name for p in tmp_path.iterdir()] == ["run"]


def test_a_complete_record_is_kept_even_where_something_fails_afterwards(tmp_path):
    with pytest.raises(ZeroDivisionError), run_directory(tmp_path / "run") as folder:
        fill(folder)
        raise ZeroDivisionError
    assert (tmp_path / "run" / METRICS).is_file()


def test_a_failed_run_leaves_the_earlier_one_untouched(tmp_path):
    with run_directory(tmp_path / "run") as folder:
        fill(folder)
        (folder / "metrics.json").write_text("first")
    with pytest.raises(ZeroDivisionError), run_directory(tmp_path / "run", replace=True) as folder:
        (folder / EVENTS).write_text("second")
        raise ZeroDivisionError
    assert (tmp_path / "run" / "metrics.json").read_text() == "first"
    assert [p.name for p in tmp_path.iterdir()] == ["run"]


def test_a_run_replaces_an_earlier_run(tmp_path):
    for text in ("first", "second"):
        with run_directory(tmp_path / "run", replace=True) as folder:
            fill(folder)
            (folder / "metrics.json").write_text(text)
    assert [p.name for p in tmp_path.iterdir()] == ["run"]
    assert (tmp_path / "run" / "metrics.json").read_text() == "second"


def test_a_run_never_replaces_anything_else(tmp_path):
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "chapter.tex").write_text("precious")
    with (
        pytest.raises(RecordError, match=r"thesis holds chapter\.tex, which no run wrote"),
        run_directory(tmp_path / "thesis", replace=True),
    ):
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
            trajectory.append(observation(step * 0.04), action, HealthSample())
        trajectory.save(tmp_path / name)
    assert (tmp_path / "one.npz").read_bytes() == (tmp_path / "two.npz").read_bytes()
    arrays = np.load(tmp_path / "one.npz")
    assert arrays["time"].tolist() == [0.0, 0.04, 0.08]
    assert arrays["hands"].tolist() == [[-1, 1]] * 3
    assert arrays["object_status"].tolist() == [[0, 1]] * 3
    assert arrays["object_position"].shape == (3, 2, 3)
    assert arrays["action"].tolist() == [
        [0, -1, 1.0, 0.1, -0.5, 0.2],
        [1, 1, 0, 0, 0, 0],
        [2, -1, 0, 0, 0, 0],
    ]


def test_a_rollout_is_recorded_as_its_single_steps(tmp_path):
    moves = np.random.default_rng(0).normal(size=(5, 4))
    seen = [
        dataclasses.replace(observation(step * 0.04), position=np.array([step, 1.0]), heading=0.1 * step)
        for step in range(7)
    ]
    healths = [HealthSample(penetration_m=0.001 * step, weld_error_m=(math.nan, 0.1)) for step in range(7)]
    rollout = Rollout.of_steps(seen[2:], range(5), [h.row for h in healths[2:]], seen[-1], ())
    single, at_once = Trajectory(["a", "b"]), Trajectory(["a", "b"])
    for trajectory in (single, at_once):
        trajectory.append(seen[0], Pick("b"), healths[0])
    for step, move in enumerate(moves, start=1):
        single.append(seen[step], Move(*move), healths[step])
    at_once.extend(seen[1], healths[1], rollout, moves)
    for trajectory in (single, at_once):
        trajectory.append(seen[-1], Move(), healths[-1])
        trajectory.save(tmp_path / f"{trajectory is single}.npz")
    assert len(single.arrays()["time"]) == 7
    assert (tmp_path / "True.npz").read_bytes() == (tmp_path / "False.npz").read_bytes()


def test_an_empty_trajectory_still_saves(tmp_path):
    Trajectory(["a"]).save(tmp_path / "t.npz")
    assert np.load(tmp_path / "t.npz")["time"].shape == (0,)


FINITE = st.floats(allow_nan=False, allow_infinity=False)
NAMES = st.none() | st.sampled_from(["a", "b", "ghost", "", "Ä"])
ACTIONS = st.builds(Move, FINITE, FINITE, FINITE, FINITE) | st.builds(Pick, NAMES) | st.builds(Place, NAMES)


@given(st.lists(ACTIONS, max_size=6))
def test_actions_are_recorded_at_full_precision(actions):
    """Names that no object has are recorded, too: a replay refuses them in the same words."""
    trajectory = Trajectory(["a", "b"])
    for action in actions:
        trajectory.append(observation(), action, HealthSample())
    arrays = trajectory.arrays()
    names = ["a", "b", *map(str, arrays["unknown_objects"])]
    again = [decode_action(row, names) for row in arrays["action"].reshape(-1, 6)]
    assert list(map(repr, again)) == list(map(repr, actions))


@pytest.mark.parametrize("row", [[3, 0], [1, 2], [1, 0.5], [2, -2], [np.nan, 0], [0, 0, np.inf]])
def test_rows_that_are_no_action_are_refused(row):
    with pytest.raises(RecordError):
        decode_action(np.array([*row, *[0.0] * (6 - len(row))]), ["a", "b"])


def test_the_log_knows_the_size_and_hash_of_its_file(tmp_path):
    with EventLog(tmp_path / "events.jsonl") as log, EventLog() as memory:
        for kept in (log, memory):
            kept.append(0.0, "start", name="Ä")
            kept.append(0.04, "picked", object="a")
        content = (tmp_path / "events.jsonl").read_bytes()
        assert log.size == memory.size == len(content)
        assert log.hash == memory.hash == int.from_bytes(hashlib.sha1(content).digest()[:8], "little")


def test_events_wait_for_those_whose_fields_are_being_worked_out():
    log, at_once = EventLog(), EventLog()
    promised = [Future() for _ in range(3)]
    log.append(0.0, "start")
    log.append_later(0.04, "plan", promised[0])
    log.append_later(0.08, "plan", promised[1])
    log.append(0.12, "picked", object="a")
    entries = log.entries
    log.append_later(0.16, "visit", promised[2])
    for future, fields in zip(promised, ({"cost_m": 1.0}, None, {"kind": "pick"}), strict=True):
        future.set_result(fields)
    at_once.append(0.0, "start")
    at_once.append(0.04, "plan", cost_m=1.0)
    at_once.append(0.12, "picked", object="a")
    assert (log.at([0, entries])[0] == [0, at_once.size]).all()
    assert log.at([entries])[1] == at_once.hash
    at_once.append(0.16, "visit", kind="pick")
    assert log.events == at_once.events
    assert (log.size, log.hash) == (at_once.size, at_once.hash)


def test_what_fails_in_working_out_an_event_is_raised_once_and_the_log_goes_on():
    log, promised = EventLog(), Future()
    log.append_later(0.0, "plan", promised)
    promised.set_exception(RecordError("no plan"))
    with pytest.raises(RecordError, match="no plan"):
        log.append(0.04, "picked", object="a")
    log.append(0.08, "end", reason="error")
    assert [event["event"] for event in log.events] == ["picked", "end"]
