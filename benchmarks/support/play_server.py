"""Run an `mjsim play` server in its own process, which can be killed, restarted and measured from outside."""

import os
import resource
import signal
import subprocess
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from urllib.parse import urlsplit

import httpx

from experiments.record.journal import JOURNAL
from experiments.record.run_directory import JOURNALS
from experiments.visit.tokens import token_hash

PATIENCE = 400.0  # timeout in seconds, which includes compiling all kernels on a busy machine
TASK_ALONE = ("--phases", "task")  # arguments of a server whose visits contain only the task
_TICKS = os.sysconf("SC_CLK_TCK")

ProgressReport = Callable[[str], None]  # function that is called with progress messages of a benchmark


class PlayProcess:
    """A server process that runs while the context is active. It logs to `server.txt` next to its folder.

    Args:
        folder: Folder for visits.
        words: Additional command-line arguments.
        core: The only core that the server may use, or None for all cores.
        command: Subcommand, such as `study serve FILE` for a study.
        program: Program to run, with its first arguments.

    Attributes:
        url: URL of the server.
        process: The server process.
    """

    def __init__(
        self,
        folder: Path,
        *words: str,
        core: int | None = None,
        command: Sequence[str] = ("play",),
        program: Sequence[str] = (sys.executable, "-m", "mjsim"),
    ) -> None:
        self._folder, self._words, self._command = folder, words, (*program, *command)
        self._cores = os.sched_getaffinity(0) if core is None else {core}
        self.output = folder.with_name("server.txt")
        self.url = ""

    def start(self) -> None:
        """Start the server and wait until it listens. After a kill, use the same port again."""
        port = urlsplit(self.url).port or 0
        command = [*self._command, "--no-open", "--port", str(port), "--out", str(self._folder), *self._words]
        with self.output.open("ab") as output:
            self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=output, text=True)
        os.sched_setaffinity(self.process.pid, self._cores)
        self.url = self.process.stdout.readline().strip() if self.process.stdout else ""
        if not self.url:
            raise ChildProcessError(self.output.read_text())

    def kill(self) -> None:
        """Kill the server with SIGKILL, which also ends its workers."""
        self.process.kill()
        self.process.communicate()  # wait for the workers, which share its output

    def begin(self) -> str:
        """Begin a visit. Return its URL."""
        origin = self.url.rstrip("/")
        with httpx.Client(base_url=origin, headers={"Origin": origin}, timeout=PATIENCE) as client:
            path = client.post("/begin").headers["location"]
            if 'value="story"' in client.get(path).text:
                client.post(path, data={"phase": "story"}, follow_redirects=True)
        return origin + path

    def visit(self, address: str) -> Path:
        return self._folder / token_hash(address.rsplit("/", 1)[1])

    def journal(self, address: str, phase: str) -> Path:
        return self.visit(address) / JOURNALS / phase / JOURNAL

    def __enter__(self) -> "PlayProcess":
        self.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.process.send_signal(signal.SIGTERM)
        try:
            self.process.communicate(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            self.kill()


def fill_disk(worker: int, journal: Path, room: int) -> None:
    """Limit a worker to `room` more bytes in its journal, in order to simulate a full disk."""
    size = journal.stat().st_size + room
    resource.prlimit(worker, resource.RLIMIT_FSIZE, (size, resource.RLIM_INFINITY))


def memory(pid: int) -> float:
    """Return the memory of a process in MB, with shared memory divided among the processes that share it."""
    lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("Pss:")) / 1024.0


def resident_memory(pid: int) -> float:
    """Return the resident memory of a process in MB, including all shared memory."""
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmRSS:")) / 1024.0


def processor_time(pid: int | str) -> float:
    """Return the CPU time of a process in seconds."""
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / _TICKS


def parent_of(pid: int) -> int:
    """Return the parent of a process. The parent of a worker is the fork server."""
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return int(fields[1])


def worker_of(journal: Path) -> int:
    """Return the process that has opened a journal. Raise a `ChildProcessError` if there is none."""
    for folder in Path("/proc").glob("[0-9]*/fd"):
        with suppress(OSError):
            if any(entry.readlink() == journal for entry in folder.iterdir()):
                return int(folder.parent.name)
    raise ChildProcessError(f"no worker has {journal} open")
