"""Records: complete or absent, and never at the cost of something else."""

import dataclasses
import hashlib
import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.errors import RecordError
from experiments.record.columns import decode_action
from experiments.record.files import CHECKSUMS, read_json, save_arrays, write_checksums
from experiments.record.journal import Header, Journal, read_entries
from experiments.record.reader import read_journal
from experiments.record.records import EPISODE, EVENTS, METRICS, RECORDING, TRAJECTORY, EventLog, read_events
from experiments.record.run_directory import run_directory
from experiments.record.verify import _log, checksum_mismatches, damage
from experiments.record.writer import RecordWriter
from mjsim.values.actions import Move, Pick, Place
from mjsim.values.episode import Episode, PlacedObject, StartPose
from mjsim.values.observation import ObjectStatus, Observation, Steps, StepStates
from mjsim.world.health.monitor import HealthSample
from mjsim.world.state import checkpoint_hash


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


EPISODE_OF_TWO = Episode(
    "house",
    0,
    StartPose(0.0, 0.0, 0.0),
    tuple(
        PlacedObject(name, "dishes", "mug", (0.0, 0.0), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
        for name in "ab"
    ),
    ("rack",),
    dict.fromkeys("ab", "rack"),
)


def new_writer():
    return RecordWriter(EPISODE_OF_TWO, EventLog())


def fill(folder):
    (folder / EPISODE).write_text("{}")
    (folder / EVENTS).write_text("")
    (folder / METRICS).write_text("{}")


def test_a_complete_record_is_kept_even_where_something_fails_afterwards(tmp_path):
    with pytest.raises(ZeroDivisionError), run_directory(tmp_path / "run") as folder:
        fill(folder)
        raise ZeroDivisionError
    assert (tmp_path / "run" / METRICS).is_file()


def test_a_run_appears_whole_and_replaces_an_earlier_one_unless_it_fails(tmp_path):
    for text in ("first", "second"):
        with run_directory(tmp_path / "run", replace=True) as folder:
            fill(folder)
            (folder / METRICS).write_text(text)
            assert (tmp_path / "run").exists() is (text == "second")
    with pytest.raises(ZeroDivisionError), run_directory(tmp_path / "run", replace=True) as folder:
        (folder / EVENTS).write_text("third")
        raise ZeroDivisionError
    assert (tmp_path / "run" / METRICS).read_text() == "second"
    assert (tmp_path / "run" / EPISODE).is_file()
    assert [p.name for p in tmp_path.iterdir()] == ["run"]


def test_unreadable_files_are_named(tmp_path):
    path = tmp_path / "metrics.json"
    with pytest.raises(RecordError, match=r"cannot read.*metrics\.json"):
        read_json(path)
    path.write_text("{")
    with pytest.raises(RecordError, match=r"metrics\.json.*is not JSON"):
        read_json(path)
    path.write_text(json.dumps({"t": 0, "event": "start"}) + '\n{"t": 1, "ev')
    with pytest.raises(RecordError, match=r"metrics\.json, line 2 is not JSON"):
        read_events(path)


def test_a_trajectory_round_trips_and_repeats_byte_for_byte(tmp_path):
    actions = [Move(1.0, 0.1, -0.5, 0.2), Pick("b"), Place(None)]
    for name in ("one.npz", "two.npz"):
        writer = new_writer()
        for step, action in enumerate(actions):
            writer.append(observation(step * 0.04), HealthSample(), step, Steps(action))
        save_arrays(tmp_path / name, writer.record().trajectory)
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


def contents(record):
    arrays = {**record.trajectory, **record.recording}
    return record.log, {name: (a.dtype, a.shape, a.tobytes()) for name, a in arrays.items()}


def test_steps_taken_at_once_are_recorded_as_single_ones():
    moves = np.random.default_rng(0).normal(size=(5, 4))
    seen = [
        dataclasses.replace(observation(step * 0.04), position=np.array([step, 1.0]), heading=0.1 * step)
        for step in range(7)
    ]
    healths = [HealthSample(penetration_m=0.001 * step, weld_error_m=(math.nan, 0.1)) for step in range(7)]
    passed = StepStates.of(seen[2:6], range(2, 6), [h.row for h in healths[2:6]])
    single, at_once = new_writer(), new_writer()
    for writer in (single, at_once):
        writer.append(seen[0], healths[0], 0, Steps(Pick("b")))
        writer.log.append(0.04, "picked", object="b")
    for step, move in enumerate(moves, start=1):
        single.append(seen[step], healths[step], step, Steps(Move(*move)))
    at_once.append(seen[1], healths[1], 1, Steps(moves, passed))
    for writer in (single, at_once):
        writer.append(seen[-1], healths[-1], 6, Steps(Move()))
    assert single.step == at_once.step == 7
    assert contents(single.record()) == contents(at_once.record())


@pytest.mark.parametrize("commits", [(), (0,), (1, 2), range(6)])
def test_the_record_of_a_journal_is_that_in_memory(tmp_path, commits):
    """However often it was committed, and the journal opened again."""
    path, memory = tmp_path / "journal.bin", new_writer()
    with Journal(path) as journal:
        journal.append(Header({}, EPISODE_OF_TWO.to_json()))
        written = RecordWriter(EPISODE_OF_TWO, EventLog(), journal)
        for step, action in enumerate([Pick("ghost"), Move(0.5), Pick("b"), Move(), Place("ghoul"), Move()]):
            for writer in (memory, written):
                writer.log.append(step * 0.04, "picked", object="Ä")
                writer.append(observation(step * 0.04), HealthSample(), step, Steps(action))
            if step in commits:
                written.commit({"input": step})
        written.log.append(0.24, "end", reason="all delivered")
        memory.log.append(0.24, "end", reason="all delivered")
        written.commit({"input": 6})
    record = read_journal(read_entries(path))
    assert contents(record) == contents(memory.record())
    assert (record.reason, record.participant) == ("all delivered", {"input": 6})


def test_an_event_that_was_written_wrongly_is_found_with_its_line_and_step():
    """Its hash is that of what was written, so only the format tells."""
    writer, sha256 = new_writer(), hashlib.sha256(EPISODE_OF_TWO.to_json().encode()).hexdigest()
    told = {key: {} for key in ("format", "model", "versions", "world", "inputs")}
    writer.log.append(0.0, "start", episode_sha256=sha256, objects=2, order=["b", "a"], **told)
    writer.append(observation(), HealthSample(), 0, Steps(Move()))
    [found] = damage(writer.record())
    assert (found.step, found.file) == (0, EVENTS)
    assert found.message.startswith("line 1: events.jsonl has an invalid event")


def logged_in_each_step(steps=6, events=1):
    """A record in which events are logged after each control step but the last one, and its log line by line."""
    writer = new_writer()
    writer.log.append(0.0, "start", episode_sha256="", objects=2, order=["b", "a"])
    for step in range(steps):
        writer.append(observation(step * 0.04), HealthSample(), step, Steps(Move()))
        for _ in range(events if step < steps - 1 else 0):
            writer.log.append(step * 0.04 + 0.04, "picked", object=f"b{step}", receptacle=None)
    record = writer.record()
    return record, record.log.splitlines(keepends=True)


@pytest.mark.parametrize("line", range(6))
def test_a_changed_line_of_the_log_is_named_with_the_step_in_which_it_was_written(line):
    record, lines = logged_in_each_step()
    assert record.steps_of_events[line] == max(0, line - 1)
    lines[line] = lines[line].replace(b'"event"', b'"Event"')
    changed = dataclasses.replace(record, log=b"".join(lines))
    assert changed.log != record.log
    [found] = _log(changed)
    assert (found.step, found.file) == (max(0, line - 1), EVENTS)
    assert found.message == f"events.jsonl is not as written, at line {line + 1}"


def test_a_changed_line_is_named_with_all_lines_of_its_step():
    record, lines = logged_in_each_step(events=3)
    lines[5] = lines[5].replace(b'"event"', b'"Event"')
    [found] = _log(dataclasses.replace(record, log=b"".join(lines)))
    assert (found.step, found.message) == (1, "events.jsonl is not as written, at line 5 to 7")


STEPS = 6


VALID_START = {
    "format": 1,
    "versions": {},
    "model": "",
    "world": {},
    "fingerprint": "",
    "inputs": {},
    "episode_sha256": hashlib.sha256(EPISODE_OF_TWO.to_json().encode()).hexdigest(),
    "order": ["b", "a"],
    "objects": 2,
    "assistance": "none",
    "house": "apartment",
    "time_limit": 1.0,
}


def with_checkpoints(**start):
    """A record of six control steps with checkpoints at three of them."""
    writer = new_writer()
    writer.log.append(0.0, "start", **(VALID_START | start))
    for step in range(STEPS):
        writer.append(observation(step * 0.04), HealthSample(), step, Steps(Move()))
    record, physics, details = writer.record(), np.arange(6.0).reshape(3, 2), ["{}", '{"hands": 1}', "[]"]
    hashes = [checkpoint_hash(*state) for state in zip(physics, details, strict=True)]
    checkpoints = {
        "checkpoint_step": np.array([0, 2, 5]),
        "checkpoint_physics": physics,
        "checkpoint_details": np.array(details),
        "checkpoint_hash": np.array(hashes, np.uint64),
    }
    return dataclasses.replace(record, recording={**record.recording, **checkpoints})


def with_array(record, name, change):
    """The record after a change of one array."""
    where = "trajectory" if name in record.trajectory else "recording"
    arrays = getattr(record, where)
    return dataclasses.replace(record, **{where: {**arrays, name: change(arrays[name].copy())}})


def increased(*rows):
    """Return a function that adds 1 to some rows of an array."""

    def change(array):
        array[list(rows)] += 1
        return array

    return change


OTHER_ACTION, OTHER_STATE = "the action is not the one", "the checkpoint is not the one"


@pytest.mark.parametrize(
    ("name", "change", "step", "file", "message"),
    [
        ("time", lambda a: a[:4], 4, TRAJECTORY, "time has 4 steps where the states have 6"),
        ("heading", lambda a: np.append(a, 0.0), 6, TRAJECTORY, "heading has 7 steps"),
        ("action_hash", lambda a: a[:3], 3, RECORDING, "action_hash has 3 steps"),
        ("log_size", lambda a: a[:3], 2, RECORDING, "log_size has 2 steps"),
        ("log_hash", lambda a: a[:3], 2, RECORDING, "log_hash has 2 steps"),
        ("action", increased(2, 4), 2, TRAJECTORY, OTHER_ACTION),
        ("action_hash", increased(5), 5, TRAJECTORY, OTHER_ACTION),
        ("checkpoint_physics", increased(1), 2, RECORDING, OTHER_STATE),
        ("checkpoint_hash", increased(0), 0, RECORDING, OTHER_STATE),
        ("checkpoint_step", lambda _: np.array([-1, 2, 5]), 0, RECORDING, OTHER_STATE),
        ("checkpoint_step", lambda _: np.array([0, 2, 6]), 6, RECORDING, OTHER_STATE),
        ("checkpoint_step", lambda _: np.array([0, 2, 9]), 6, RECORDING, OTHER_STATE),
        ("checkpoint_details", lambda a: a[:1], 2, RECORDING, "checkpoints are missing"),
        ("checkpoint_step", lambda a: a[:2], 0, RECORDING, "checkpoints are missing"),
    ],
)
def test_a_damaged_array_is_named_with_the_first_step_that_it_affects(name, change, step, file, message):
    record = with_checkpoints()
    assert damage(record) == []
    [found] = damage(with_array(record, name, change))
    assert (found.step, found.file) == (step, file) and message in found.message


@pytest.mark.parametrize(
    ("start", "file", "message"),
    [
        ({"episode_sha256": "0" * 64}, EPISODE, "episode.json is not the episode that was run"),
        ({"objects": 3}, EVENTS, "the start event has 3 objects, the episode has 2"),
        ({"order": ["b", "b"]}, EVENTS, "the start event has an order of other objects than the episode's"),
    ],
)
def test_a_start_event_of_another_episode_is_named(start, file, message):
    [found] = damage(with_checkpoints(**start))
    assert (found.step, found.file) == (0, file) and found.message.endswith(message)


def test_damage_is_listed_in_the_order_of_steps():
    record = with_array(with_checkpoints(order=["b", "b"]), "action", increased(4))
    found = damage(with_array(record, "checkpoint_physics", increased(1)))
    assert [mismatch.step for mismatch in found] == [0, 2, 4]


@pytest.mark.parametrize("kept", range(1, 6))
def test_a_log_that_was_cut_off_is_named_with_the_first_step_of_which_it_lacks_events(kept):
    record, lines = logged_in_each_step()
    assert list(_log(record)) == []
    short = dataclasses.replace(record, log=b"".join(lines[:kept]))
    [found] = _log(short)
    assert "truncated" in found.message
    assert (found.step, found.file) == (max(0, kept - 1), EVENTS)


def test_a_log_that_continues_or_whose_sizes_go_backwards_is_named():
    record, lines = logged_in_each_step()
    longer = dataclasses.replace(record, log=record.log + lines[-1])
    [found] = _log(longer)
    assert "continues" in found.message
    assert (found.step, found.file) == (5, EVENTS)
    for row in range(1, 6):
        sizes = record.recording["log_size"].copy()
        sizes[row] = sizes[row - 1] - 1
        shrunk = dataclasses.replace(record, recording={**record.recording, "log_size": sizes})
        [found] = _log(shrunk)
        assert "backwards" in found.message
        assert (found.step, found.file) == (row - 1, RECORDING)


def test_files_that_are_missing_changed_or_added_after_a_run_are_named(tmp_path):
    fill(tmp_path)
    write_checksums(tmp_path, (EPISODE, EVENTS))
    (tmp_path / "notes.txt").write_text("of a user's own")
    found = {m.file: m.message for m in checksum_mismatches(tmp_path)}
    assert set(found) == {METRICS} and "was not written with the run" in found[METRICS]
    (tmp_path / EPISODE).write_text("{ }")
    (tmp_path / EVENTS).unlink()
    found = {m.file: m.message for m in checksum_mismatches(tmp_path)}
    assert "is not the file that was written" in found[EPISODE] and "is missing" in found[EVENTS]
    (tmp_path / CHECKSUMS).unlink()
    assert [m.file for m in checksum_mismatches(tmp_path)] == [CHECKSUMS]


def test_a_journal_without_control_steps_is_an_empty_record():
    with pytest.raises(RecordError, match="the journal is empty"):
        read_journal(())
    assert read_journal((Header({}, EPISODE_OF_TWO.to_json()),)).steps == 0


FINITE = st.floats(allow_nan=False, allow_infinity=False)
NAMES = st.none() | st.sampled_from(["a", "b", "ghost", "", "Ä"])
ACTIONS = st.builds(Move, FINITE, FINITE, FINITE, FINITE) | st.builds(Pick, NAMES) | st.builds(Place, NAMES)


@given(st.lists(ACTIONS, max_size=6))
def test_actions_are_recorded_at_full_precision(actions):
    """Names that no object has are recorded, too: a replay refuses them in the same words."""
    writer = new_writer()
    for action in actions:
        writer.append(observation(), HealthSample(), 0, Steps(action))
    arrays = writer.record().trajectory
    names = ["a", "b", *map(str, arrays["unknown_objects"])]
    again = [decode_action(row, names) for row in arrays["action"].reshape(-1, 6)]
    assert list(map(repr, again)) == list(map(repr, actions))


@pytest.mark.parametrize("row", [[3, 0], [1, 2], [1, 0.5], [2, -2], [np.nan, 0], [0, 0, np.inf]])
def test_rows_that_are_no_action_are_refused(row):
    with pytest.raises(RecordError):
        decode_action(np.array([*row, *[0.0] * (6 - len(row))]), ["a", "b"])


def test_the_log_knows_its_size_and_hash_after_every_entry():
    log = EventLog()
    for time, event, name in ((0.0, "start", "Ä"), (0.04, "plan", "a"), (0.12, "picked", "a")):
        log.append(time, event, object=name)
    lines = log.content.splitlines(keepends=True)
    assert lines[2] == b'{"t": 0.12, "event": "picked", "object": "a"}\n'
    assert log.entries == len(log.events) == 3
    sizes, hashes = log.at([0, 1, 2, 3])
    assert sizes.tolist() == [len(b"".join(lines[:k])) for k in range(4)]
    for size, found in zip(sizes, hashes, strict=True):
        assert found == int.from_bytes(hashlib.sha1(log.content[:size]).digest()[:8], "little")
