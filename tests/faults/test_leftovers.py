"""Work in progress of processes that were killed is removed after a day."""

import errno
import os
import time

import pytest

from mjsim.support.files import MAX_AGE, WORK, exchange, remove_leftovers, replacing, work_folder


@pytest.mark.parametrize("name", ["house.xml", "trials/episode.json"])
def test_work_is_removed_once_it_has_not_changed_for_a_day(name, tmp_path):
    abandoned, recent = tmp_path / f"{WORK}killed", tmp_path / f"{WORK}living"
    for work in (abandoned, recent):
        (work / name).parent.mkdir(parents=True)
        (work / name).write_text("half")
    for path in (abandoned, recent, *abandoned.rglob("*"), (recent / name).parent):
        os.utime(path, (time.time() - MAX_AGE - 1,) * 2)
    with replacing(tmp_path / "other.txt") as temporary:
        temporary.write_text("new")
    assert {path.name for path in tmp_path.iterdir()} == {"other.txt", recent.name}
    remove_leftovers(tmp_path, max_age=0)
    assert [path.name for path in tmp_path.iterdir()] == ["other.txt"]


def test_a_process_looks_for_leftovers_once(tmp_path, monkeypatch):
    """A batch writes thousands of trials into one folder, and listing it takes longer the more there are."""
    searched = []
    monkeypatch.setattr("mjsim.support.files.remove_leftovers", lambda folder: searched.append(folder))
    for _ in range(3):
        with work_folder(tmp_path):
            pass
    assert searched == [tmp_path]


@pytest.mark.parametrize("failure", [OSError, KeyboardInterrupt])
def test_work_that_fails_leaves_nothing(failure, tmp_path):
    for make in (lambda: work_folder(tmp_path), lambda: replacing(tmp_path / "house.xml")):
        with pytest.raises(failure), make():
            raise failure
    assert not list(tmp_path.iterdir())


def test_a_full_disk_is_told_with_the_place_that_was_written(tmp_path):
    for place in (tmp_path, tmp_path / "house.xml"):
        make = work_folder if place == tmp_path else replacing
        with pytest.raises(OSError, match=str(place)) as failure, make(place):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        assert failure.value.filename == str(place)


def test_what_others_hide_is_kept(tmp_path):
    (tmp_path / ".mjsim-notes").mkdir()
    (tmp_path / f"{WORK}link").symlink_to(tmp_path / ".mjsim-notes")
    (tmp_path / ".mjsim-notes" / "note").touch()
    remove_leftovers(tmp_path, max_age=0)
    assert (tmp_path / ".mjsim-notes" / "note").exists()


def test_an_exchange_with_nothing_is_an_error(tmp_path):
    (tmp_path / "one").mkdir()
    with pytest.raises(FileNotFoundError):
        exchange(tmp_path / "one", tmp_path / "two")
    assert (tmp_path / "one").is_dir()
