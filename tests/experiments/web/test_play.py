"""The options of `mjsim play`."""

import pytest

from experiments.cli.main import main


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["--user", "follower"], "belongs to `mjsim run`"),
        (["--assistance", "nonsense"], "no assistance condition"),
        (["--objects", "0"], "objects is 0"),
        (["--port", "70000"], "not a number from 0 to 65535"),
        (["--sessions", "0"], "not a number from 1"),
        (["--film", "nothing.mp4"], "there is no film"),
        (["--public-url", "ftp://x"], "must be of the form"),
        (["--host", "no.such.host.invalid"], "name another --port (0 for any) or --host"),
    ],
)
def test_bad_options_are_named_in_one_line(tmp_path, capsys, words, text):
    try:
        code = main(["play", "--no-open", "--out", str(tmp_path / "out"), "--port", "0", *words])
    except SystemExit as stop:
        code = stop.code
    error = capsys.readouterr().err
    assert code in (1, 2) and text in error and error.count("\n") == 1
