"""Commands that are killed at chosen moments, and whether their files are in the end those of undisturbed ones."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow.csv

from experiments.runs import records
from experiments.runs.checksums import CHECKSUMS
from experiments.trials.table import NAME

SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)
POLL = 0.005  # s
TIMEOUT = 600.0  # s
_TICKS = os.sysconf("SC_CLK_TCK")
_FAST = ("--objects", "6", "--fidelity", "event", "--no-regret")


@dataclass(frozen=True)
class Command:
    """A command that writes to a place of its own.

    Attributes:
        words: The command line after `mjsim`, without `--out`.
        is_batch: Whether the same command goes on where it was killed; a run begins anew.
    """

    words: tuple[str, ...]
    is_batch: bool


RUN = Command(("run", *_FAST, "--no-video"), is_batch=False)
BATCH = Command(
    ("batch", *_FAST, "--assistance", "none,optimal", "--seeds", "0:2", "--workers", "2"), is_batch=True
)


def start(command: Command, out: Path, *more: str) -> subprocess.Popen[bytes]:
    """Start a command in a process group of its own; what it says is in `out` with the suffix `.txt`."""
    temporary = out.parent / "tmp"
    temporary.mkdir(parents=True, exist_ok=True)
    with out.with_suffix(".txt").open("wb") as file:
        return subprocess.Popen(
            [sys.executable, "-m", "mjsim", *command.words, "--out", str(out), *more],
            stdout=subprocess.DEVNULL,
            stderr=file,
            env={**os.environ, "TMPDIR": str(temporary)},
            start_new_session=True,
        )


def finish(command: Command, out: Path, *more: str) -> float:
    """Run a command to its end; the processor time that it took, s.

    Raises:
        RuntimeError: It fails.
    """
    before = os.times()
    code = start(command, out, *more).wait(TIMEOUT)
    if code:
        raise RuntimeError(
            f"{' '.join(command.words)} ended with {code}: {out.with_suffix('.txt').read_text()}"
        )
    after = os.times()
    return after.children_user + after.children_system - before.children_user - before.children_system


def kill(process: subprocess.Popen[bytes], number: signal.Signals, cpu: float, *, group: bool) -> int:
    """Send a signal once a process and its children have used some processor time; the exit code.

    Moments are measured in processor time, so that they mean the same on a busy machine.

    Args:
        process: Leader of its process group.
        number: The signal.
        cpu: Processor time, s.
        group: Whether all processes of the group get the signal, as on Ctrl-C, or the first alone.
    """
    deadline = time.monotonic() + TIMEOUT
    while process.poll() is None and group_time(process.pid) < cpu and time.monotonic() < deadline:
        time.sleep(POLL)
    if process.poll() is None:
        (os.killpg if group else os.kill)(process.pid, number)
    code = process.wait(TIMEOUT)
    while group_time(process.pid) > 0 and time.monotonic() < deadline:  # workers follow their parent
        time.sleep(POLL)
    return code


def group_time(group: int) -> float:
    """Processor time of the living processes of a group, s."""
    total = 0
    for folder in Path("/proc").iterdir():
        if folder.name.isdecimal():
            try:
                fields = (folder / "stat").read_text().rpartition(")")[2].split()
            except OSError:
                continue
            if int(fields[2]) == group and fields[0] != "Z":
                total += int(fields[11]) + int(fields[12]) + 1  # one more, as a new process has used none
    return total / _TICKS


def differences(out: Path, expected: Path) -> list[str]:
    """Files that differ from those of an undisturbed command, that are missing, or that are left over."""
    mine, theirs = _files(out), _files(expected)
    return sorted(
        name
        for name in mine.keys() | theirs.keys()
        if name not in mine or name not in theirs or _content(mine[name]) != _content(theirs[name])
    )


def leftovers(folder: Path, expected: Sequence[str]) -> list[str]:
    """What lies in a folder that should not be there."""
    found = [path.relative_to(folder).as_posix() for path in folder.rglob("*")]
    return [
        name for name in found if name.split("/")[0] not in expected or "/." in f"/{name}" or "tmp/" in name
    ]


def _files(out: Path) -> dict[str, Path]:
    return {path.relative_to(out).as_posix(): path for path in out.rglob("*") if path.is_file()}


def _content(path: Path) -> Any:
    """What has to be equal: all but wall times, and the checksums of files that hold them."""
    if path.name == records.METRICS:
        return {name: value for name, value in json.loads(path.read_text()).items() if name != "wall_s"}
    if path.name == CHECKSUMS:
        return [line for line in path.read_text().splitlines() if records.METRICS not in line]
    if path.name == f"{NAME}.csv":
        return pyarrow.csv.read_csv(path).drop_columns(["wall_s"]).to_pylist()
    if path.name == f"{NAME}.parquet":
        return None  # the same rows as the CSV
    return path.read_bytes()
