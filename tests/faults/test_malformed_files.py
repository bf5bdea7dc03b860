"""Inputs that are none: every reader says in one line which file it is, and nothing is written."""

import pytest

from experiments.cli.main import main
from faults.conftest import one_line

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


@pytest.mark.parametrize("content", BAD_TEXTS.values(), ids=BAD_TEXTS)
@pytest.mark.parametrize(
    ("words", "name"),
    [
        (["plan", "FILE"], "problem.json"),
        (["run", "--out", "OUT", "--no-video", "--episode", "FILE"], "episode.json"),
        (["run", "--out", "OUT", "--no-video", "--house", "FILE"], "catalogue.toml"),
        (["batch", "FILE", "--out", "OUT"], "design.toml"),
    ],
    ids=["problem", "episode", "catalogue", "design"],
)
def test_inputs(words, name, content, tmp_path, capsys):
    (tmp_path / name).write_bytes(content)
    places = {"FILE": tmp_path / name, "OUT": tmp_path / "out"}
    assert main([str(places.get(word, word)) for word in words]) in (1, 2)
    assert name in one_line(capsys.readouterr().err)
    assert [path.name for path in tmp_path.iterdir()] == [name]
