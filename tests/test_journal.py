"""The journal of a session: whatever happens to the file, what was synced is there, and nothing else."""

import resource
import signal

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from experiments.errors import RecordError
from experiments.web.journal import MAGIC, Journal, read_journal

RECORDS = st.lists(st.binary(max_size=300), max_size=12)
FEW = settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


def written(path, records):
    path.unlink(missing_ok=True)
    with Journal(path) as journal:
        for record in records:
            journal.append(record)
        journal.sync()
    return path


@FEW
@given(RECORDS, st.lists(st.binary(max_size=50), max_size=3))
def test_what_was_appended_is_read_and_appended_to(tmp_path, records, more):
    path = written(tmp_path / "journal", records)
    assert list(read_journal(path)) == records
    with Journal(path) as journal:
        assert list(journal.records) == records
        for record in more:
            journal.append(record)
    assert list(read_journal(path)) == records + more


@FEW
@given(RECORDS.filter(bool), st.data())
def test_a_journal_that_was_cut_off_keeps_all_records_before_the_cut(tmp_path, records, data):
    path = written(tmp_path / "journal", records)
    content = path.read_bytes()
    size = data.draw(st.integers(0, len(content) - 1))
    path.write_bytes(content[:size])
    with Journal(path) as journal:
        kept = list(journal.records)
        journal.append(b"later")
    assert kept == records[: len(kept)]
    assert len(kept) == sum(
        len(MAGIC) + sum(8 + len(r) for r in records[: i + 1]) <= size for i in range(len(records))
    )
    assert list(read_journal(path)) == [*kept, b"later"]


@FEW
@given(RECORDS.filter(bool), st.data())
def test_a_damaged_byte_is_never_read_as_a_record(tmp_path, records, data):
    path = written(tmp_path / "journal", records)
    content = bytearray(path.read_bytes())
    place = data.draw(st.integers(len(MAGIC), len(content) - 1))
    content[place] ^= data.draw(st.integers(1, 255))
    path.write_bytes(content)
    read = list(read_journal(path))
    assert read == records[: len(read)] and len(read) < len(records)


def test_another_file_is_refused(tmp_path):
    path = tmp_path / "notes.txt"
    path.write_text("my notes, longer than the first bytes of a journal")
    with pytest.raises(RecordError, match="not the journal"):
        Journal(path)
    assert path.read_text().startswith("my notes")


def test_a_full_disk_leaves_whole_records(tmp_path):
    path = tmp_path / "journal"
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    before = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    try:
        with Journal(path) as journal:
            resource.setrlimit(resource.RLIMIT_FSIZE, (500, limits[1]))
            with pytest.raises(OSError, match="large"):
                for _ in range(10):
                    journal.append(b"x" * 100)
            resource.setrlimit(resource.RLIMIT_FSIZE, limits)
            journal.append(b"after")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, before)
    assert list(read_journal(path)) == [b"x" * 100] * 4 + [b"after"]


def test_a_journal_belongs_to_one_process_at_a_time(tmp_path, monkeypatch):
    path = tmp_path / "journal"
    with Journal(path):
        monkeypatch.setattr("experiments.web.journal.LOCK_PATIENCE", 0.1)
        with pytest.raises(RecordError, match="in use by another process"):
            Journal(path)
    with Journal(path) as journal:
        assert journal.records == ()
