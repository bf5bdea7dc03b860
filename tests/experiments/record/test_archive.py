"""Packed runs: every commit that was reported survives, damage is named, and unpacking gives the same bytes.

`MJSIM_FAULTS=1000` kills a writer a thousand times instead of 15 (about 60 ms each).
"""

import os
import random
import resource
import signal
import sqlite3
import subprocess
import time
from contextlib import closing

import pytest

from experiments.errors import RecordError
from experiments.record import archive as archive_module
from experiments.record import records
from experiments.record.archive import (
    adopt,
    discard,
    new_archive,
    opened_run,
    pack,
    packed_names,
    run_paths,
    unpack,
)
from experiments.record.files import write_checksums
from experiments.record.run_directory import TRIALS, is_batch

KILLS = int(os.environ.get("MJSIM_FAULTS", "15"))
LONGEST = 0.03  # s of writing before a kill
FILES = {
    records.EPISODE: b'{"objects": []}\n' * 300,
    records.EVENTS: b'{"event": "start"}\n' * 900,
    records.TRAJECTORY: random.Random(1).randbytes(60_000),  # does not shrink
    records.RECORDING: random.Random(2).randbytes(20_000),
    records.METRICS: b"{}\n",
    records.PLAN: b"",
}


def write_run(path, files=FILES):
    for folder in (path, path / records.TRAINING):
        folder.mkdir(parents=True)
        for name, content in files.items():
            (folder / name).write_bytes(content)
        write_checksums(folder, records.FILES)
    return path


def content(folder):
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def packed(folder, *names):
    """An archive in `folder` with runs of these names."""
    folder.mkdir(exist_ok=True)
    with closing(new_archive(folder, "test")) as database:
        for name in names:
            pack(write_run(folder.parent / "made" / name), database)
            (folder.parent / "made" / name).rename(folder.parent / f"was-{name}")
    adopt(folder)
    return next(path for path in folder.glob("test-*.sqlar"))


def damage(archive, member, change):
    with closing(sqlite3.connect(archive)) as database, database:
        ((data,),) = database.execute("SELECT data FROM sqlar WHERE name = ?", (member,)).fetchall()
        database.execute("UPDATE sqlar SET data = ? WHERE name = ?", (change(data), member))


def test_unpacking_gives_the_same_bytes(tmp_path):
    archive = packed(tmp_path / TRIALS, "one", "two")
    assert run_paths(tmp_path / TRIALS) == [archive / "one", archive / "two"]
    assert is_batch(tmp_path)
    for path in (archive / "two", tmp_path / TRIALS / "two"):
        with opened_run(path) as run:
            assert content(run) == content(tmp_path / "was-two")
            assert (run / records.EVENTS).stat().st_mtime == int(
                (tmp_path / "was-two" / records.EVENTS).stat().st_mtime
            )
    with opened_run(tmp_path / "was-two") as run:
        assert run == tmp_path / "was-two"
    with opened_run(tmp_path / TRIALS / "three") as run:
        assert run == tmp_path / TRIALS / "three"


def test_the_sqlite_shell_reads_an_archive(tmp_path):
    archive = packed(tmp_path / TRIALS, "one")
    out = tmp_path / "shell"
    out.mkdir()
    try:
        subprocess.run(["sqlite3", archive, "-A", "-x", "-C", out], check=True, capture_output=True)
    except FileNotFoundError:
        pytest.skip("needs the sqlite3 shell")
    assert content(out / "one") == content(tmp_path / "was-one")


def write_until_killed(folder, run, report):
    """In a forked process: commit the run under new names, and report each one that is committed."""
    database, number = new_archive(folder, "test"), 0
    while True:
        name = f"{os.getpid()}-{number}"
        run = run.rename(run.with_name(name))
        pack(run, database)
        os.write(report, f"{name}\n".encode())
        number += 1


@pytest.mark.slow
def test_a_killed_writer_loses_nothing_that_was_committed(tmp_path):
    folder, choice, intact = tmp_path / TRIALS, random.Random(0), tmp_path / "intact"
    folder.mkdir()
    expected = content(write_run(intact))
    rolled_back = 0
    for number in range(KILLS):
        run = write_run(tmp_path / "run" / f"{number}")
        reports, report = os.pipe()
        process = os.fork()
        if not process:
            try:
                write_until_killed(folder, run, report)
            finally:
                os._exit(1)
        os.close(report)
        first = os.read(reports, 1000)
        assert adopt(folder) == 1  # it is locked by its writer
        time.sleep(choice.random() * LONGEST)
        os.kill(process, signal.SIGKILL)
        assert os.WIFSIGNALED(os.waitpid(process, 0)[1])
        with os.fdopen(reports, "rb") as rest:
            reported = {name.decode() for name in (first + rest.read()).splitlines()}
        rolled_back += any(
            p.stat().st_size and p.read_bytes()[:1] != b"\0" for p in folder.glob(".*-journal")
        )
        assert adopt(folder) == 0
        (archive,) = folder.iterdir()  # neither a journal nor a hidden file is left
        with closing(sqlite3.connect(archive)) as database:
            assert database.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
        names = packed_names(archive)
        assert names >= reported and len(names - reported) <= 1
        for name in names:
            unpack(archive, name, tmp_path / "out")
            assert content(tmp_path / "out" / name) == expected
        archive.unlink()
    assert KILLS < 100 or rolled_back > KILLS / 10, (
        "too few writers were killed in the middle of a transaction"
    )


def test_a_disk_that_fills_up_loses_nothing_that_was_committed(tmp_path):
    folder = tmp_path / TRIALS
    folder.mkdir()
    run = write_run(tmp_path / "run" / "0")
    process = os.fork()
    if not process:
        database = new_archive(folder, "test")
        pack(run, database)
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        size = next(folder.glob(".*.sqlar")).stat().st_size
        _, most = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (size + 8192, most))
        run = run.rename(run.with_name("1"))
        try:
            pack(run, database)
        except RecordError as error:
            resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))
            pack(run.rename(run.with_name("2")), database)  # there is space again
            os._exit(0 if "cannot pack 1: " in str(error) else 2)
        os._exit(1)
    assert os.waitpid(process, 0)[1] == 0
    adopt(folder)
    (archive,) = folder.iterdir()
    assert packed_names(archive) == {"0", "2"}
    for name in ("0", "2"):
        unpack(archive, name, tmp_path)


def test_a_commit_is_synced(tmp_path):
    with closing(new_archive(tmp_path, "test")) as database:
        (synchronous,), (journal,), (lock,) = (
            database.execute(f"PRAGMA {name}").fetchone()
            for name in ("synchronous", "journal_mode", "locking_mode")
        )
    assert (synchronous, journal, lock) == (2, "delete", "exclusive")  # 2 is FULL


def test_an_archive_of_a_writer_that_has_ended_before_its_first_run_is_deleted(tmp_path):
    new_archive(tmp_path, "test").close()
    (tmp_path / ".test-cut.sqlar").touch()  # killed before the schema was written
    assert adopt(tmp_path) == 0
    assert list(tmp_path.iterdir()) == []


def test_an_archive_that_is_adopted_before_its_writer_has_the_lock_is_not_written(tmp_path, monkeypatch):
    real, raced = archive_module._connect, []

    def connect(path, mode, *wait):
        database = real(path, mode, *wait)
        if not raced:
            raced.append(path)
            adopt(tmp_path)
        return database

    monkeypatch.setattr(archive_module, "_connect", connect)
    with closing(new_archive(tmp_path, "test")) as database:
        pack(write_run(tmp_path / "made" / "run"), database)
    assert adopt(tmp_path) == 0
    assert [path.name for path in run_paths(tmp_path) if path.parent.suffix] == ["run"]
    assert not raced[0].exists()


def test_an_archive_that_another_process_adopts_meanwhile_is_left_alone(tmp_path, monkeypatch):
    real = archive_module._connect
    with closing(new_archive(tmp_path, "test")) as database:
        pack(write_run(tmp_path / "made" / "run"), database)

    def connect(path, mode, *wait):
        monkeypatch.setattr(archive_module, "_connect", real)
        database = real(path, mode, *wait)
        adopt(tmp_path)
        return database

    monkeypatch.setattr(archive_module, "_connect", connect)
    assert adopt(tmp_path) == 0
    assert len(list(tmp_path.glob("test-*.sqlar"))) == 1 and not list(tmp_path.glob(".*"))


@pytest.mark.parametrize(
    ("member", "change"),
    [
        (records.TRAJECTORY, lambda data: data[:-1] + bytes([data[-1] ^ 1])),
        (records.TRAJECTORY, lambda data: data[:-1]),
        (records.EVENTS, lambda data: b"y" + data[1:]),
        (records.EVENTS, lambda _: None),
        (f"{records.TRAINING}/{records.RECORDING}", lambda data: bytes(len(data))),
    ],
)
def test_a_damaged_file_is_named(tmp_path, member, change):
    archive = packed(tmp_path / TRIALS, "one", "two")
    damage(archive, f"one/{member}", change)
    with (
        pytest.raises(RecordError, match=f"{archive}: one.*{member.rpartition('/')[2]}"),
        opened_run(archive / "one"),
    ):
        pass
    with opened_run(archive / "two"):
        pass


def test_a_damaged_archive_is_named(tmp_path):
    archive = packed(tmp_path / TRIALS, "one")
    archive.write_bytes(b"x" * 100 + archive.read_bytes()[100:])
    with pytest.raises(RecordError, match=f"cannot read {archive}"):
        run_paths(tmp_path / TRIALS)
    archive.rename(archive.with_name(f".{archive.name}"))
    with pytest.raises(RecordError, match="move it away"):
        adopt(tmp_path / TRIALS)


def test_a_file_is_never_written_elsewhere(tmp_path):
    archive = packed(tmp_path / TRIALS, "one")
    with closing(sqlite3.connect(archive)) as database, database:
        database.execute("UPDATE sqlar SET name = 'one/../../out' WHERE name = 'one/plan.json'")
    (tmp_path / "in").mkdir()
    with pytest.raises(RecordError, match="not a valid file name"):
        unpack(archive, "one", tmp_path / "in")
    assert not (tmp_path / "out").exists()


def test_runs_are_moved_and_discarded_in_all_archives(tmp_path):
    trials, outdated = tmp_path / TRIALS, tmp_path / "outdated"
    packed(trials, "one", "two")
    other = packed(trials, "three")
    size = sum(path.stat().st_size for path in trials.iterdir())
    outdated.mkdir()
    discard(trials, {"two", "three", "four"}, outdated)
    assert [path.name for path in run_paths(trials)] == ["one"]
    assert [path.name for path in run_paths(outdated)] == ["three", "two"]
    assert sum(path.stat().st_size for path in trials.iterdir()) < 0.4 * size
    for path in run_paths(outdated):
        with opened_run(path) as run:
            assert content(run) == content(tmp_path / f"was-{path.name}")
    discard(trials, {"one"})
    assert list(trials.iterdir()) == [] and not other.exists()
