"""A session with a person continues after a crash as if there had been none, and leaves a run that replays."""

import itertools
import os
import shutil
import socket
import zipfile
from pathlib import Path

import msgspec
import numpy as np
import pytest

from experiments.record.files import CHECKSUMS, read_arrays, read_json, save_arrays, write_checksums
from experiments.record.journal import read_entries
from experiments.record.reader import read_journal
from experiments.record.records import EVENTS, FILES, METRICS, RECORDING, TOPDOWN, TRAJECTORY
from experiments.record.verify import damage
from experiments.trials.replay.replay import replay
from experiments.trials.trial_config import TrialConfig
from experiments.web import protocol
from experiments.web.controls import Input
from experiments.web.protocol import Open, Saved
from experiments.web.worker.live_session import (
    LiveSession,
    journal_of,
    open_journal,
    remove_journal,
    save_run,
)
from experiments.web.worker.main import Worker
from planner.solvers import SolveLimit

pytestmark = pytest.mark.usefixtures("frequent_checkpoints")
CONFIG = TrialConfig(objects=6, assistance="guided", seed=3, user="human", live=True, fidelity="event")


def wandering(seed: int, steps: int):
    """What a restless person presses, one batch a control step."""
    rng, number = np.random.default_rng(seed), 0
    for _ in range(steps):
        batch = []
        for _ in range(rng.integers(0, 3) if rng.random() < 0.2 else 0):
            number += 1
            axes = {"forward": float(rng.choice([0.0, 1.0, 1.0])), "yaw": float(rng.normal(0.0, 0.7))}
            press = str(rng.choice(["", "", "act", "left hand"])) or None
            batch.append(Input(number=number, **axes, press=press, scroll=int(rng.choice([0, 0, 0, 2, -1]))))
        yield batch


def play(folder, house, batches, *, config=None, **language):
    """Play batches of inputs; the session, still open."""
    journal = open_journal(folder)
    session = LiveSession(journal, house, config, **language)
    for batch in batches:
        session.step(batch)
    journal.sync()
    return session


def crash(session):
    """Leave a session as the death of its process does."""
    session.close()
    session._journal.close()


def state(session):
    shown = session.session.assistant.hud_state(session.world.observation())
    return (
        session.world.state_hash(),
        session.session.record.step,
        session.input,
        shown.checklist,
        shown.scroll,
    )


@pytest.mark.parametrize("cut", [1, 7, 49, 50, 51, 103, 250])
def test_a_session_resumes_in_the_same_state_with_the_same_plan(house, tmp_path, cut):
    batches = list(wandering(cut, 300))
    whole = play(tmp_path / "whole", house, batches[:cut], config=CONFIG)
    shutil.copytree(tmp_path / "whole", tmp_path / "crashed")
    resumed = play(tmp_path / "crashed", house, [])
    assert resumed.resumed and resumed.config.settings() == CONFIG.settings()
    assert state(resumed) == state(whole)
    for batch in batches[cut:]:
        whole.step(batch)
        resumed.step(batch)
    assert state(resumed)[:3] == state(whole)[:3]
    for session in (whole, resumed):
        session.end("interrupted")


@pytest.mark.parametrize(("objects", "method"), [(24, zipfile.ZIP_LZMA), (40, zipfile.ZIP_DEFLATED)])
def test_a_session_with_many_objects_is_saved_with_the_faster_compression(house, tmp_path, objects, method):
    config = msgspec.structs.replace(CONFIG, objects=objects)
    play(tmp_path / "session", house, wandering(1, 20), config=config).end("interrupted")
    save_run(tmp_path / "session", tmp_path / "run", floor_plan=False)
    for name in (TRAJECTORY, RECORDING):
        with zipfile.ZipFile(tmp_path / "run" / name) as archive:
            assert {member.compress_type for member in archive.infolist()} == {method}
    assert replay(tmp_path / "run", house=house).steps == 20


def test_a_german_session_shows_german_and_leaves_the_bytes_of_an_english_one(house, tmp_path):
    batches, shown = list(wandering(5, 260)), {}
    config = msgspec.structs.replace(CONFIG, live=False)
    for language in ("en", "de"):
        session = play(tmp_path / language, house, batches, config=config, language=language)
        state = session.session.assistant.hud_state(session.world.observation())
        words = (
            state.checklist_title,
            state.bins[0].label,
            state.bins[0].place,
            session.shown.rooms.label("kitchen"),
        )
        shown[language] = words
        session.end("interrupted")
        run = tmp_path / f"{language}_run"
        save_run(tmp_path / language, run, session.shown)
        shown[run.name] = {
            path.relative_to(run): path.read_bytes()
            for path in run.rglob("*")
            if path.is_file() and path.name not in (TOPDOWN, CHECKSUMS)
        }
    assert shown["en"] == ("Your plan", "Dish bin", "Kitchen, on the counter, beside the sink", "Kitchen")
    assert shown["de"] == (
        "Ihr Plan",
        "Geschirrkorb",
        "Küche, auf der Arbeitsplatte neben der Spüle",
        "Küche",
    )
    assert Path(EVENTS) in shown["en_run"] and shown["de_run"] == shown["en_run"]
    plans = [(tmp_path / f"{language}_run" / TOPDOWN).read_bytes() for language in ("en", "de")]
    assert plans[0] != plans[1], "the floor plan is for the person"


@pytest.mark.parametrize(("crashes", "planner"), [((), "ortools"), ((60, 61, 170), "exact")])
def test_the_run_directory_of_a_session_replays(house, tmp_path, monkeypatch, crashes, planner):
    monkeypatch.setattr("planner.solver_source.PROOF_LIMIT", SolveLimit(seconds=0.3))
    batches = list(wandering(5, 260))
    config = msgspec.structs.replace(CONFIG, planner=planner)
    session = play(tmp_path / "session", house, batches[: crashes[0] if crashes else 260], config=config)
    for first, end in itertools.pairwise((*crashes, 260)):
        crash(session)
        session = play(tmp_path / "session", house, batches[first:end])
    session.end("interrupted")
    save_run(tmp_path / "session", tmp_path / "run", house)
    metrics = read_json(tmp_path / "run" / METRICS)
    assert (metrics["ended"], metrics["user"], metrics["planner"]) == ("interrupted", "human", planner)
    assert metrics["planned_distance_m"] > 0 and session.config.settings() == config.settings()
    report = replay(tmp_path / "run", house=house)
    assert report.steps == 260


def test_an_unfinished_session_leaves_a_run_that_replays(house, tmp_path):
    session = play(tmp_path / "session", house, wandering(8, 120), config=CONFIG)
    save_run(tmp_path / "session", tmp_path / "run", house)
    session.close()
    assert replay(tmp_path / "run", house=house).steps == 120
    (tmp_path / "run" / TOPDOWN).unlink()  # as a kill in between leaves it
    save_run(tmp_path / "session", tmp_path / "run", house)
    assert (tmp_path / "run" / TOPDOWN).is_file()
    assert journal_of(tmp_path / "session") == tmp_path / "session" and journal_of(tmp_path) is None


def test_a_journal_that_is_full_ends_the_session(tmp_path, house, monkeypatch):
    session = play(tmp_path, house, wandering(0, 3), config=CONFIG)
    assert session.end_reason is None
    monkeypatch.setattr("experiments.web.worker.live_session.MAX_JOURNAL", 100)
    assert session.end_reason == "interrupted"
    crash(session)


@pytest.fixture(scope="module")
def saved(house, tmp_path_factory):
    """The journal and the run directory of a session that is over."""
    folder = tmp_path_factory.mktemp("saved")
    session = play(folder / "journals" / "task", house, wandering(4, 60), config=CONFIG)
    session.end("interrupted")
    session._journal.close()
    save_run(folder / "journals" / "task", folder / "task", house)
    return folder


@pytest.fixture
def visit(saved, tmp_path):
    return shutil.copytree(saved, tmp_path / "visit")


def test_a_journal_is_deleted_once_its_run_is_on_the_disk(visit, monkeypatch):
    journal, synced = visit / "journals" / "task", set()
    fsync, unlink = os.fsync, os.unlink

    def sync(file):
        synced.add(str(Path(f"/proc/self/fd/{file}").readlink()))
        fsync(file)

    def remove(path, **options):
        if os.fspath(path).endswith("journal.bin"):
            run = visit / "task"
            assert synced >= {str(path) for path in (run, visit, *run.iterdir())}, "a power cut would lose it"
        unlink(path, **options)

    monkeypatch.setattr(os, "fsync", sync)
    monkeypatch.setattr(os, "unlink", remove)
    remove_journal(journal, visit / "task")
    assert not (visit / "journals").exists()
    assert journal_of(visit / "task") is None
    assert replay(visit / "task").steps == 60
    remove_journal(journal, visit / "task")  # as after a kill right after it was deleted


def _shorten(run):
    """A run that is consistent in itself, but lacks a control step."""
    arrays = read_arrays(run / TRAJECTORY)
    save_arrays(run / TRAJECTORY, {name: array[:-1] for name, array in arrays.items()})
    write_checksums(run, FILES)


@pytest.mark.parametrize(
    "harm",
    [
        lambda run: shutil.rmtree(run),
        lambda run: (run / EVENTS).write_bytes(b""),  # as a power cut may leave it
        lambda run: (run / METRICS).write_text("{}"),
        lambda run: (run / CHECKSUMS).unlink(),
        _shorten,
    ],
)
def test_a_journal_whose_run_does_not_hold_all_of_it_is_kept(visit, harm, caplog):
    journal = visit / "journals" / "task"
    before = (journal / "journal.bin").read_bytes()
    harm(visit / "task")
    remove_journal(journal, visit / "task")
    assert (journal / "journal.bin").read_bytes() == before
    assert "journal.bin is kept: " in caplog.text


def test_a_line_that_is_no_event_is_damage_even_if_all_hashes_fit(saved):
    header, *entries = read_entries(saved / "journals" / "task" / "journal.bin")
    assert damage(read_journal([header, *entries])) == []
    number = next(k for k, entry in enumerate(entries) if k and entry.events)
    wrong = msgspec.structs.replace(entries[number], events=['{"event": "nonsense", "time": 1.0}'])
    found = damage(read_journal([header, *entries[:number], wrong, *entries[number + 1 :]]))
    assert [mismatch.file for mismatch in found] == [EVENTS]
    assert f"line {1 + sum(len(entry.events) for entry in entries[:number])}: " in found[0].message


@pytest.mark.parametrize("stage", ["saved", "drawn", "deleted"])
def test_a_worker_killed_while_it_saves_leaves_a_session_that_is_over(visit, house, monkeypatch, stage):
    """The next worker ends what was begun; it starts no new session where the journal is deleted already."""
    journal, run = visit / "journals" / "task", visit / "task"
    trajectory = (run / TRAJECTORY).read_bytes()
    if stage == "saved":
        (run / TOPDOWN).unlink()
        write_checksums(run, FILES)
    if stage == "deleted":
        remove_journal(journal, run)
    monkeypatch.setattr("experiments.web.worker.houses.house", lambda _: house)
    here, there = socket.socketpair()
    with here, there:
        worker = Worker(here)
        worker._serve(Open(str(journal), str(run), CONFIG.settings(), []), worker._control)
        sent = there.recv(1 << 20)
    assert sent.endswith(protocol.packed(Saved())) and not (visit / "journals").exists()
    assert (run / TRAJECTORY).read_bytes() == trajectory and (run / TOPDOWN).is_file()


def test_a_run_that_cannot_be_written_stays_in_the_journal_alone(visit, house, monkeypatch):
    """Nothing of a participant is written to the temporary folder, where it would not be found again."""

    def full(*_, **__):
        raise OSError(28, "No space left on device")

    shutil.rmtree(visit / "task")
    monkeypatch.setattr("experiments.record.writer.save_arrays", full)
    monkeypatch.setattr("experiments.record.writer._save_elsewhere", lambda *_: pytest.fail("kept elsewhere"))
    with pytest.raises(OSError, match="No space left"):
        save_run(visit / "journals" / "task", visit / "task", house)
    assert not (visit / "task").exists() and (visit / "journals" / "task" / "journal.bin").is_file()
