"""Commands in children of a process that has loaded everything: milliseconds each, not seconds.

Every case has a folder of its own, limits of time and memory, and is judged by what it says, how it ends and what
becomes of the files that were there.
"""

import contextlib
import hashlib
import multiprocessing
import os
import re
import resource
import shutil
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

CPU_LIMIT = 10.0  # s of the processor
WALL_LIMIT = 40.0  # s that a command may wait for others
MEMORY = 12 << 30  # bytes
LONGEST = 3000  # characters that a refusal may have
PIPE, CLOSED = "a pipe that never ends", "closed"
REFUSED, USED = "refused", "used"
BAD = re.compile(r"Traceback \(most recent|internal error|Fatal Python error|\w*Warning: ")
UNSTABLE = "replay the recorded actions"  # part of the message when the physics of an accepted model fails
EXIT = os._exit  # which commands may replace
ENDS = (0, 1, 2)
LARGEST_COMPARED = 10_000_000  # bytes of a file whose content is compared
PREVIEW = "-preview.png"  # how pictures end that a refusal shows


@dataclass(frozen=True)
class Case:
    """A command, or a call of the library, in a folder that was prepared for it.

    Attributes:
        command: What is tried.
        kind: What is hostile about it.
        words: Its command line; empty where `call` is tried.
        must: `refused`, `used`, or empty where either is right.
        call: What is called instead of the command line; an error of the library's own is a refusal.
        stdin: What standard input holds, `PIPE` or `CLOSED`.
        message: Part of the message with which it is refused.
        changes: Folder whose files it may change.
    """

    command: str
    kind: str
    words: Sequence[str] = ()
    must: str = ""
    call: Callable[[], Any] | None = None
    stdin: bytes | str = b""
    message: str = ""
    changes: str = ""


@dataclass(frozen=True)
class Outcome:
    """What became of a case; `fault` is empty where all is well."""

    number: int
    command: str
    kind: str
    line: str
    seconds: float
    result: str
    fault: str = ""
    output: str = ""


@dataclass
class CaseFactory:
    """Makes cases in a process that has loaded what they need.

    Attributes:
        prepare: Loads all, and writes what good cases need into a folder.
        make: The case of a number, whose files it damages in a copy of that folder.
    """

    prepare: Callable[[Path], None]
    make: Callable[[int, Path], Case]
    template: Path = field(default_factory=lambda: Path(tempfile.mkdtemp(prefix="mjsim-cases-")))

    def attempt(self, number: int) -> Outcome:
        """Try the case of a number."""
        with tempfile.TemporaryDirectory(prefix="mjsim-case-") as scratch:
            folder = Path(scratch) / "here"
            shutil.copytree(self.template, folder, symlinks=True)
            case = self.make(number, folder)
            before, began = _files(folder), time.perf_counter()
            code, hung = _run(case, folder, Path(scratch))
            seconds = time.perf_counter() - began
            output = "".join(_text(Path(scratch) / name) for name in ("err", "out"))
            fault = "hang" if hung else _fault(case, code, output, before, _files(folder))
            result = "used" if code == 0 else "refused"
            line = " ".join(case.words)
            return Outcome(number, case.command, case.kind, line, seconds, result, fault, output[-LONGEST:])


def run_cases(
    case_factory: Callable[[], CaseFactory], numbers: Sequence[int], workers: int
) -> Iterator[Outcome]:
    """Outcomes of the cases of these numbers, as they come."""
    context = multiprocessing.get_context("spawn")
    os.environ["OPENBLAS_NUM_THREADS"] = "1"  # of the processes below: time of the processor is counted
    connections: dict[Connection, BaseProcess] = {}
    for k in range(min(workers, len(numbers))):
        ours, theirs = context.Pipe()
        connections[ours] = context.Process(target=_work, args=(theirs, case_factory, numbers[k::workers]))
        connections[ours].start()
        theirs.close()
    while connections:
        for ready in (c for c in wait(list(connections)) if isinstance(c, Connection)):
            try:
                yield ready.recv()
            except EOFError as error:
                process = connections.pop(ready)
                process.join()
                if process.exitcode:
                    raise RuntimeError("the cases end with an error of their own") from error


def _work(connection: Connection, case_factory: Callable[[], CaseFactory], numbers: Sequence[int]) -> None:
    with tempfile.TemporaryDirectory(prefix="mjsim-state-") as state:
        os.environ["XDG_STATE_HOME"] = state
        made = case_factory()
        try:
            made.prepare(made.template)
            for number in numbers:
                connection.send(made.attempt(number))
        finally:
            shutil.rmtree(made.template, ignore_errors=True)


def _run(case: Case, folder: Path, scratch: Path) -> tuple[int, bool]:
    """The exit code, negative for a signal, and whether it had to be stopped."""
    if (child := os.fork()) == 0:
        code = 1
        try:
            _enter(case, folder, scratch)
            code = _end(case)
        except BaseException:
            traceback.print_exc()
        finally:
            with contextlib.suppress(Exception):
                sys.stdout.flush()
                sys.stderr.flush()
            EXIT(code)
    ends, found = time.monotonic() + WALL_LIMIT, 0
    while not found and time.monotonic() < ends:
        time.sleep(0.002)
        found, status = os.waitpid(child, os.WNOHANG)
    with contextlib.suppress(ProcessLookupError):
        os.killpg(child, signal.SIGKILL)  # and what it left behind
    if not found:
        _, status = os.waitpid(child, 0)
    code = os.waitstatus_to_exitcode(status)
    return code, not found or code == -signal.SIGXCPU


def _enter(case: Case, folder: Path, scratch: Path) -> None:
    os.setsid()
    os.chdir(folder)
    resource.setrlimit(resource.RLIMIT_CPU, (int(CPU_LIMIT), int(CPU_LIMIT) + 5))
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    for number, name in ((1, "out"), (2, "err")):
        os.dup2(os.open(scratch / name, os.O_WRONLY | os.O_CREAT), number)
    sys.stdout, sys.stderr = (open(n, "w", encoding="utf-8", errors="backslashreplace") for n in (1, 2))  # noqa: PTH123, SIM115
    if case.stdin == CLOSED:
        os.close(0)
        sys.stdin = None
        return
    if case.stdin == PIPE:
        reading, _ = os.pipe()  # this process holds the other end
    else:
        (scratch / "in").write_bytes(case.stdin)  # type: ignore[arg-type]
        reading = os.open(scratch / "in", os.O_RDONLY)
    os.dup2(reading, 0)
    sys.stdin = open(0, encoding="utf-8")  # noqa: SIM115


def _end(case: Case) -> int:
    from experiments.cli.failures import end_with
    from experiments.cli.main import main

    warnings.resetwarnings()
    if case.call is None:
        sys.argv = ["mjsim", *case.words]
        try:
            return main()
        except SystemExit as stop:
            return int(stop.code or 0)
    try:
        case.call()
    except Exception as error:
        return end_with(error, [])
    return 0


def _fault(case: Case, code: int, output: str, before: Mapping[str, str], after: Mapping[str, str]) -> str:
    """What is wrong with how a case ended, empty for nothing."""
    if code < 0:
        return f"died of {signal.Signals(-code).name}"
    if BAD.search(output) or code not in ENDS:
        return f"traceback (exit {code})"
    if UNSTABLE in output:
        return "accepted, but its physics failed"
    lost = [name for name in before if after.get(name) != before[name]]
    if lost and not (
        code == 0 and case.changes and all(name.startswith(f"{case.changes}/") for name in lost)
    ):
        return f"lost {lost[0]}"
    new = [name for name in after if name not in before and not (name.endswith(PREVIEW) and name in output)]
    if half := [name for name in new if _is_half(name, code, after)]:
        return f"half-written {half[0]}"
    if code == 0:
        return "silent wrong" if case.must == REFUSED else ""
    if not output.strip() or (case.message and case.message not in output):
        return "refused without its reason"
    if len(output) > LONGEST and "mjsim: " in output[:LONGEST]:
        return "refused at length"
    return "refused what is good" if case.must == USED else ""


def _is_half(name: str, code: int, after: Mapping[str, str]) -> bool:
    """Whether a new file is work in progress, or what a command left that failed; failed runs are kept whole."""
    if ".mjsim-work-" in name:
        return True
    folder = str(Path(name).parent)
    kept = f"{folder}/SHA256SUMS" in after or name.startswith("out/trials") or "__pycache__" in name
    return code != 0 and not kept


def _files(folder: Path) -> dict[str, str]:
    """What every file of a folder holds."""
    found = {}
    for path in folder.rglob("*"):
        if path.is_symlink() or path.is_fifo() or path.stat().st_size > LARGEST_COMPARED:
            found[str(path.relative_to(folder))] = "special"
        elif path.is_file():
            found[str(path.relative_to(folder))] = hashlib.md5(path.read_bytes()).hexdigest()
    return found


def _text(path: Path) -> str:
    return path.read_text("utf-8", "replace") if path.exists() else ""
