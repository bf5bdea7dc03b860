"""The journal of a session: whatever happens to the file, what was synced is there, and nothing else."""

import os
import resource
import signal
import stat
import zlib

import msgspec
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from experiments.errors import RecordError
from experiments.record.journal import MAGIC, Journal, JournalEntry, read_entries
from experiments.web.protocol import Taken
from experiments.web.worker.clock import _Acknowledger

ENTRIES = st.builds(JournalEntry, st.binary(max_size=300), st.lists(st.text(max_size=20), max_size=3))
RECORDS = st.lists(ENTRIES, max_size=12)
LATER, FULL = JournalEntry(b"later", []), JournalEntry(b"x" * 100, ["line"])
encode = msgspec.msgpack.encode
FEW = settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


def written_bytes(entry):
    return MAGIC + len(entry).to_bytes(4, "little") + zlib.crc32(entry).to_bytes(4, "little") + entry


def written(path, records):
    path.unlink(missing_ok=True)
    with Journal(path) as journal:
        for record in records:
            journal.append(record)
        journal.sync()
    return path


@FEW
@given(RECORDS, st.lists(ENTRIES, max_size=3))
def test_what_was_appended_is_read_and_appended_to(tmp_path, records, more):
    path = written(tmp_path / "journal", records)
    assert list(read_entries(path)) == records
    with Journal(path) as journal:
        assert list(journal.entries) == records
        for record in more:
            journal.append(record)
    assert list(read_entries(path)) == records + more


@FEW
@given(RECORDS.filter(bool), st.data())
def test_a_journal_that_was_cut_off_keeps_all_records_before_the_cut(tmp_path, records, data):
    path = written(tmp_path / "journal", records)
    content = path.read_bytes()
    size = data.draw(st.integers(0, len(content) - 1))
    path.write_bytes(content[:size])
    with Journal(path) as journal:
        kept = list(journal.entries)
        journal.append(LATER)
    assert kept == records[: len(kept)]
    assert len(kept) == sum(
        len(MAGIC) + sum(8 + len(encode(r)) for r in records[: i + 1]) <= size for i in range(len(records))
    )
    assert list(read_entries(path)) == [*kept, LATER]


@FEW
@given(RECORDS.filter(bool), st.data())
def test_a_damaged_byte_is_never_read_as_a_record(tmp_path, records, data):
    path = written(tmp_path / "journal", records)
    content = bytearray(path.read_bytes())
    place = data.draw(st.integers(len(MAGIC), len(content) - 1))
    content[place] ^= data.draw(st.integers(1, 255))
    path.write_bytes(content)
    read = list(read_entries(path))
    assert read == records[: len(read)] and len(read) < len(records)


@pytest.fixture
def on_disk(monkeypatch):
    """Sizes of files, by inode, that a power cut leaves: those at their last sync."""
    sizes = {}

    def syncing(call):
        def sync(file):
            call(file)
            found = os.fstat(file)
            sizes[found.st_ino] = found.st_size

        return sync

    for name in ("fsync", "fdatasync"):
        monkeypatch.setattr(os, name, syncing(getattr(os, name)))
    return lambda path: sizes.get(path.stat().st_ino)


def test_a_journal_that_was_made_survives_a_power_cut(tmp_path, on_disk):
    with Journal(tmp_path / "journal"):
        assert on_disk(tmp_path / "journal") == len(MAGIC), "its first bytes"
        assert on_disk(tmp_path) is not None, "its name"


def test_a_journal_without_what_was_cut_off_survives_a_power_cut(tmp_path, on_disk):
    path = written(tmp_path / "journal", [FULL])
    whole = path.stat().st_size
    with path.open("ab") as file:
        file.write(b"cut off")
    with Journal(path):
        assert on_disk(path) == whole == path.stat().st_size


def test_everything_before_a_sync_survives_a_power_cut(tmp_path, on_disk):
    path = tmp_path / "journal"
    with Journal(path) as journal:
        for number in range(1, 4):
            journal.append(FULL)
            before = on_disk(path)
            journal.append(LATER)
            journal.sync()
            assert before < on_disk(path) == path.stat().st_size
            (tmp_path / "after").write_bytes(path.read_bytes()[: on_disk(path)])
            assert read_entries(tmp_path / "after") == (FULL, LATER) * number


def test_an_input_is_acknowledged_once_it_is_on_the_disk(tmp_path, on_disk):
    path, sent = tmp_path / "journal", []
    with Journal(path) as journal:
        acknowledger = _Acknowledger(journal.sync, lambda taken: sent.append((taken, on_disk(path))))
        sizes = []
        for number in range(1, 6):
            journal.append(FULL)
            sizes.append(journal.size)
            acknowledger.request(number, number)
        acknowledger.close()
    assert sent[-1][0] == Taken(5, 5)
    assert all(size >= sizes[taken.input - 1] for taken, size in sent)


def test_another_file_is_refused(tmp_path):
    path = tmp_path / "notes.txt"
    path.write_text("my notes, longer than the first bytes of a journal")
    with pytest.raises(RecordError, match="not the journal"):
        Journal(path)
    assert path.read_text().startswith("my notes")


def test_a_full_disk_leaves_whole_records(tmp_path):
    path = tmp_path / "journal"
    written, limits = 0, resource.getrlimit(resource.RLIMIT_FSIZE)
    before = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    try:
        with Journal(path) as journal:
            resource.setrlimit(resource.RLIMIT_FSIZE, (500, limits[1]))
            with pytest.raises(OSError, match="large"):
                while True:
                    journal.append(FULL)
                    written += 1
            resource.setrlimit(resource.RLIMIT_FSIZE, limits)
            journal.append(LATER)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, before)
    assert list(read_entries(path)) == [FULL] * written + [LATER]


def test_a_journal_belongs_to_one_process_at_a_time(tmp_path, monkeypatch):
    path = tmp_path / "journal"
    with Journal(path):
        monkeypatch.setattr("experiments.record.journal.LOCK_TIMEOUT_S", 0.1)
        with pytest.raises(RecordError, match="in use by another process"):
            Journal(path)
    with Journal(path) as journal:
        assert journal.entries == ()


@pytest.mark.parametrize(
    "content",
    [b"mjsim journal 1\n" + b"\x00" * 40, written_bytes(b"\x80"), written_bytes(encode({"type": "Step"}))],
)
def test_a_journal_of_another_version_is_refused_in_one_line(tmp_path, content):
    path = tmp_path / "journal"
    path.write_bytes(content)
    for opened in (Journal, read_entries):
        with pytest.raises(RecordError, match=r"^[^\n]*is a journal of another version of mjsim[^\n]*$"):
            opened(path)
    assert path.read_bytes() == content


def test_only_its_user_may_read_a_journal(tmp_path):
    with Journal(tmp_path / "journal.bin"):
        assert stat.S_IMODE((tmp_path / "journal.bin").stat().st_mode) == 0o600
