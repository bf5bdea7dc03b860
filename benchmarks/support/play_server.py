"""A server of `mjsim play` in a process of its own: started, killed, started again, and measured from outside."""

import os
import resource
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from urllib.parse import urlsplit

import httpx

from experiments.web.journal import JOURNAL
from experiments.web.visits import JOURNALS, token_hash

PATIENCE = 300.0  # s; a loaded machine may be slow
IDLE = 0.5  # s without work after which a worker is taken for warm
_TICKS = os.sysconf("SC_CLK_TCK")


class PlayProcess:
    """A server, from entering the context until leaving it. What it says goes into `server.txt` beside its folder.

    Args:
        folder: Where it keeps visits.
        words: Further words of its command line.

    Attributes:
        url: Its URL.
        process: The process.
    """

    def __init__(self, folder: Path, *words: str) -> None:
        self._folder, self._words = folder, words
        self.output = folder.with_name("server.txt")
        self.url = ""

    def start(self) -> None:
        """Start it, after a kill at the same port; returns as soon as it listens."""
        port = urlsplit(self.url).port or 0
        command = ["play", "--no-open", "--port", str(port), "--out", str(self._folder), *self._words]
        with self.output.open("ab") as output:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "mjsim", *command], stdout=subprocess.PIPE, stderr=output, text=True
            )
        self.url = self.process.stdout.readline().strip() if self.process.stdout else ""
        if not self.url:
            raise ChildProcessError(self.output.read_text())

    def kill(self) -> None:
        """`kill -9`; its workers notice by themselves."""
        self.process.kill()
        self.process.communicate()

    def begin(self) -> str:
        """Begin a visit; its address."""
        origin = self.url.rstrip("/")
        answer = httpx.post(f"{origin}/visits", headers={"Origin": origin}, timeout=PATIENCE)
        return origin + answer.headers["location"]

    def visit(self, address: str) -> Path:
        """Folder of a visit."""
        return self._folder / token_hash(address.rsplit("/", 1)[1])

    def journal(self, address: str, phase: str) -> Path:
        """Journal of a phase of a visit."""
        return self.visit(address) / JOURNALS / phase / JOURNAL

    def workers(self) -> list[int]:
        """Process numbers of its workers."""
        path = Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children")
        return [int(number) for number in path.read_text().split()]

    def worker_of(self, journal: Path) -> int | None:
        """The worker that has a journal open."""
        return next((pid for pid in self.workers() if journal in _open_files(pid)), None)

    def wait_for_spare(self) -> None:
        """Wait until a worker is warm that could take a session over.

        Raises:
            TimeoutError: There is none.
        """
        until = time.monotonic() + PATIENCE
        while time.monotonic() < until:
            before = self._idle_times()
            time.sleep(IDLE)
            if any(before.get(pid) == spent for pid, spent in self._idle_times().items()):
                return
        raise TimeoutError("no spare worker became ready")

    def _idle_times(self) -> dict[int, float]:
        """Processor time of the workers without a session, s."""
        busy = [pid for pid in self.workers() if any(path.name == JOURNAL for path in _open_files(pid))]
        return {pid: processor_time(pid) for pid in self.workers() if pid not in busy}

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
    """Let a worker write only so many bytes more to its journal, as if the disk was full then."""
    size = journal.stat().st_size + room
    resource.prlimit(worker, resource.RLIMIT_FSIZE, (size, resource.RLIM_INFINITY))


def memory(pid: int) -> float:
    """Memory of a process, MB; what it shares with others counts in part."""
    lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("Pss:")) / 1024.0


def processor_time(pid: int) -> float:
    """Processor time of a process, s."""
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / _TICKS


def _open_files(pid: int) -> set[Path]:
    files = set()
    with suppress(OSError):
        for entry in Path(f"/proc/{pid}/fd").iterdir():
            with suppress(OSError):
                files.add(entry.readlink())
    return files
