"""Errors end in one line with the right exit code; bugs of ours in a report."""

import errno
import json
import os
import shutil
import subprocess
import sys
import warnings
from pathlib import Path
from unittest.mock import Mock

import pytest

from experiments.cli.failures import INTERNAL_ERROR, _report_text, message
from experiments.cli.main import main
from faults.conftest import PROBLEM, ROOT, one_line


@pytest.fixture
def problem(tmp_path):
    path = tmp_path / "problem.json"
    path.write_text(json.dumps(PROBLEM))
    return str(path)


@pytest.mark.parametrize(
    ("error", "code", "said"),
    [
        (MemoryError("Unable to allocate 9 TiB"), 1, "not enough memory (Unable to allocate 9 TiB)"),
        (OSError(errno.ENOSPC, "No space left on device", "/a"), 1, "/a: No space left on device"),
        (
            shutil.Error([("a", "b", "[Errno 28] No space left: 'b'")]),
            1,
            "mjsim: [Errno 28] No space left: 'b'",
        ),
        (ImportError("libGL.so.1: cannot open"), 1, "libGL.so.1: cannot open; `mjsim doctor`"),
        (ValueError("embedded null byte"), 2, "a path has a null character in it"),
        (KeyError("x"), INTERNAL_ERROR, "internal error (KeyError: 'x')"),
        (ValueError("two\nlines"), INTERNAL_ERROR, "internal error (ValueError: two lines)"),
        (RecursionError("too deep"), INTERNAL_ERROR, "internal error (RecursionError: too deep)"),
    ],
)
def test_an_error_is_one_line(error, code, said, problem, tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setattr("experiments.cli.plan.solver", Mock(side_effect=error))  # of no user
    assert main(["plan", problem]) == code
    line = one_line(capsys.readouterr().err)
    assert said in line
    reports = list((tmp_path / "state").rglob("*.txt"))
    assert [str(path) for path in reports] == ([line.rpartition(" ")[2]] if code == INTERNAL_ERROR else [])


def test_a_report_says_what_is_needed_and_no_secrets(problem, tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setenv("API_TOKEN", "sesame")
    monkeypatch.setattr("experiments.cli.failures.exit_code", lambda _: None)
    assert main(["plan", problem + ".gone", "--planner", "greedy"]) == INTERNAL_ERROR
    report = Path(capsys.readouterr().err.split()[-1]).read_text()
    assert "Traceback" in report and "--planner greedy" in report and "mujoco 3." in report
    url = "postgresql://ada:sesame@host/study?password=sesame"
    words = [
        "--api-token",
        "sesame",
        "--password=sesame",
        "--port",
        "1",
        "--database",
        url,
        f"--database={url}",
    ]
    report += _report_text(ValueError(f"cannot reach {url}"), ["fly", *words])
    report += message(ValueError(f"cannot reach {url}"))
    with pytest.raises(SystemExit):
        main(["plan", problem, url])
    report += capsys.readouterr().err
    assert "sesame" not in report and "--port 1" in report


@pytest.mark.parametrize(
    "words",
    [
        "",
        "--no-such",
        "run --out=--",
        "run --size 160x120",
        "replay x --eye nan,0,0",
        "run",
        "run --out",
        "plan a b",
        "fly",
        "play --port 70000",
        "play --sessions 0",
    ],
)
def test_a_command_line_that_is_none(words, capsys):
    with pytest.raises(SystemExit) as stop:
        main(words.split())
    assert stop.value.code == 2
    line = one_line(capsys.readouterr().err)
    assert "--help" in line and ("is not a number from" in line) == words.startswith("play")


@pytest.mark.parametrize(
    ("target", "code"),
    [("/dev/full", 1), ("| true", 141), (">&-", 1), ("2>&-", 0)],
    ids=["full", "no reader", "closed", "errors"],
)
def test_an_output_that_takes_nothing(target, code, problem, tmp_path):
    redirect = target if target[0] in "|>2" else f"> {target}"
    command = f"{sys.executable} -m mjsim plan {problem} {redirect}; exit ${{PIPESTATUS[0]}}"
    environment = {"PYTHONPATH": str(ROOT), "HOME": str(tmp_path)}
    done = subprocess.run(
        ["bash", "-c", command], capture_output=True, text=True, timeout=120, env=environment
    )
    assert done.returncode == code
    assert "Traceback" not in done.stderr and len(done.stderr.splitlines()) == (code == 1)


@pytest.mark.parametrize(
    ("command", "code", "said"),
    [
        ("plan - <&-", 2, "standard input is closed"),
        ("plan - </dev/zero", 2, "cannot read standard input: larger than 256 MB"),
        ("--version >&-", 0, ""),
    ],
)
def test_clumsy_redirections(command, code, said, problem, tmp_path):
    line = f"{sys.executable} -m mjsim {command.format(problem=problem)}"
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(line, shell=True, cwd=tmp_path, capture_output=True, text=True, env=environment)
    assert done.returncode == code and said in done.stderr
    assert len(done.stderr.splitlines()) == bool(said)


@pytest.mark.parametrize(
    ("command", "said"),
    [
        ("study power nope.toml --pool .", "no study 'nope.toml'"),
        ("plan {problem} --check {problem} --time-limit 1", "--check plans nothing"),
        ("plan {problem} --time-limit 0", "--time-limit 0 must be positive"),
    ],
)
def test_clumsy_command_lines(command, said, problem, capsys):
    assert main(command.format(problem=problem).split()) == 2
    assert said in one_line(capsys.readouterr().err)


def test_no_error_is_longer_than_a_few_lines(problem, capsys):
    assert main(["plan", problem, "--planner", "x" * 10_000]) == 2
    assert len(one_line(capsys.readouterr().err)) < 700


def test_warnings_of_libraries_reach_nobody(problem, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["mjsim", "plan", problem])
    monkeypatch.setattr(sys, "warnoptions", [])
    with warnings.catch_warnings(record=True) as caught:
        warnings.resetwarnings()
        warn = Mock(side_effect=lambda *_: warnings.warn("x", RuntimeWarning, stacklevel=2))
        monkeypatch.setattr("experiments.cli.plan._publish", warn)
        assert main() == 0
    assert warn.called and not caught


def test_a_folder_that_is_gone(problem, tmp_path, capsys, monkeypatch):
    (tmp_path / "gone").mkdir()
    monkeypatch.chdir(tmp_path / "gone")
    (tmp_path / "gone").rmdir()
    assert main(["plan", problem]) == 1
    assert "the current folder was removed" in one_line(capsys.readouterr().err)
    monkeypatch.undo()
