"""Inputs that are none: every reader says in one line which file it is, and nothing is written."""

import errno
import json
import os
import signal

import pytest

from experiments.cli.main import main
from faults.conftest import FAST, PROBLEM, one_line
from mjsim.support.files import read_stream, replacing

DEEP = 200_000  # brackets in brackets
BAD_TEXTS = {
    "deep lists": b"[" * DEEP + b"]" * DEEP,
    "deep objects": b'{"a":' * DEEP + b"1" + b"}" * DEEP,
    "deep TOML": b"a = " + b"[" * DEEP + b"]" * DEEP,
    "not UTF-8": b'{"name": "caf\xe9"}',
    "empty": b"",
    "null": b"null",
    "number": b"1e999",
    "list": b"[]",
    "NUL": b"\0" * 100,
    "long number": b"9" * 10_000,
    "infinite": b'{"distances": [[0, 1e999], [1e999, 0]]}',
    "cut off": b"{",
}


READERS = {
    "problem.json": "plan FILE",
    "episode.json": "run --out OUT --no-video --episode FILE",
    "catalogue.toml": "run --out OUT --no-video --house FILE",
    "design.toml": "batch FILE --out OUT",
    "person.toml": "run --out OUT --no-video --person FILE",
}


def told(words, folder, capsys):
    """The line with which a command refuses a file; it writes nothing."""
    before = sorted(folder.iterdir())
    places = {"FILE": before[0], "OUT": folder / "out"}
    assert main([str(places.get(word, word)) for word in words.split()]) in (1, 2)
    assert sorted(folder.iterdir()) == before
    return one_line(capsys.readouterr().err)


@pytest.mark.parametrize("content", BAD_TEXTS.values(), ids=BAD_TEXTS)
@pytest.mark.parametrize("name", READERS)
def test_inputs(name, content, tmp_path, capsys):
    (tmp_path / name).write_bytes(content)
    if (name, content) != ("person.toml", b""):  # nobody is described: the usual person
        assert name in told(READERS[name], tmp_path, capsys)


@pytest.fixture
def alarm():
    """Ends a test that waits for a file without end."""
    signal.signal(signal.SIGALRM, lambda *_: pytest.fail("reads without end"))
    signal.alarm(60)
    yield
    signal.alarm(0)


ENDLESS = {
    **READERS,
    "story.txt": f"run --out OUT --no-video --phases story,task --story FILE {' '.join(FAST)}",
    "object.xml": "check FILE",
    "part.obj": "import object FILE --category toys --out OUT",
    "trials.parquet": "study analyze FOLDER --out OUT",
    "events.jsonl": "replay FOLDER",
}


@pytest.mark.usefixtures("alarm")
@pytest.mark.parametrize("kind", ["pipe", "device", "huge"])
@pytest.mark.parametrize("name", ENDLESS)
def test_inputs_without_end(name, kind, tmp_path, capsys):
    path = tmp_path / name
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "device":
        path.symlink_to("/dev/zero")
    else:
        path.touch()
        os.truncate(path, 1 << 40)  # a hole
    assert str(tmp_path) in told(ENDLESS[name].replace("FOLDER", str(tmp_path)), tmp_path, capsys)


@pytest.mark.usefixtures("alarm")
@pytest.mark.parametrize("limits", [{"MAX_SILENCE": 0.05}, {"MAX_WAIT": 0.05}, {"MAX_INPUT": 10}], ids=str)
def test_a_stream_that_does_not_end(limits, monkeypatch):
    """One that sends nothing more, or goes on too long, or has too much."""
    for name, value in limits.items():
        monkeypatch.setattr(f"mjsim.support.files.{name}", value)
    reading, writing = os.pipe()
    os.write(writing, b'{"distances": ')
    with pytest.raises(OSError, match=r"does not end|larger than"):
        read_stream(reading)
    os.close(writing)
    os.close(reading)


TWICE = json.dumps(PROBLEM)[:-1]


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("problem.json", TWICE + ', "shipments": []}', "the key 'shipments' is there twice"),
        ("problem.json", TWICE.replace('"pickup": 0', '"pickup": 1, "pickup": 0') + "}", "'pickup' is there"),
        ("problem.json", TWICE.replace("1]", "NaN]", 1) + "}", "malformed"),
        ("problem.json", TWICE + ', "speed": 1}', "unknown field `speed`"),
    ],
)
def test_json_is_read_strictly(name, text, said, tmp_path, capsys):
    (tmp_path / name).write_text(text)
    assert said in told(READERS[name], tmp_path, capsys)


def test_a_byte_order_mark_is_no_fault(tmp_path, capsys):
    (tmp_path / "problem.json").write_text(json.dumps(PROBLEM), encoding="utf-8-sig")
    assert main(["plan", str(tmp_path / "problem.json")]) == 0
    assert json.loads(capsys.readouterr().out)["visits"] == [0, 1]


def test_catalogues_that_extend_each_other_without_end(tmp_path, capsys):
    for k in range(1500):
        (tmp_path / f"{k:04}.toml").write_text(f'extends = "{k + 1:04}.toml"')
    assert "does not lead to a complete catalogue" in told(READERS["catalogue.toml"], tmp_path, capsys)


def test_a_full_disk_is_told_with_the_file(tmp_path):
    with pytest.raises(OSError, match=r"No space.*there\.txt"), replacing(tmp_path / "there.txt"):
        raise OSError(errno.ENOSPC, "No space left on device")
