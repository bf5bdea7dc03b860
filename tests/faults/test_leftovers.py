"""Work in progress of processes that were killed is removed; that of living ones is not."""

import signal
import subprocess
import sys

import pytest

from mjsim.files import WORK, exchange, remove_leftovers, replacing, work_folder

WORKER = """
import sys, time
from pathlib import Path
from mjsim.files import {what}
with {what}(Path(sys.argv[1]){more}) as path:
    print(path, flush=True)
    time.sleep(60)
"""


@pytest.mark.parametrize(("what", "more"), [("work_folder", ""), ("replacing", " / 'house.xml'")])
def test_work_is_removed_once_its_process_is_gone(what, more, tmp_path):
    script = WORKER.format(what=what, more=more)
    with subprocess.Popen([sys.executable, "-c", script, str(tmp_path)], stdout=subprocess.PIPE) as process:
        process.stdout.readline()
        remove_leftovers(tmp_path)
        assert len(list(tmp_path.glob(f"{WORK}*"))) == 1, "the process lives"
        process.send_signal(signal.SIGKILL)
        process.wait()
    assert len(list(tmp_path.glob(f"{WORK}*"))) == 1
    with replacing(tmp_path / "other.txt") as temporary:
        temporary.write_text("new")
    assert [path.name for path in tmp_path.iterdir()] == ["other.txt"]


def test_what_others_hide_is_kept(tmp_path):
    (tmp_path / ".mjsim-notes").mkdir()
    (tmp_path / f"{WORK}link").symlink_to(tmp_path / ".mjsim-notes")
    with work_folder(tmp_path):
        pass
    assert (tmp_path / ".mjsim-notes").is_dir()


def test_folders_are_exchanged(tmp_path):
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        (tmp_path / name / name).touch()
    exchange(tmp_path / "one", tmp_path / "two")
    assert (tmp_path / "one" / "two").exists() and (tmp_path / "two" / "one").exists()


def test_an_exchange_with_nothing_is_an_error(tmp_path):
    (tmp_path / "one").mkdir()
    with pytest.raises(FileNotFoundError):
        exchange(tmp_path / "one", tmp_path / "two")
    assert (tmp_path / "one").is_dir()
