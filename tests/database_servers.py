"""MariaDB and PostgreSQL as processes of their own, on a free port, with their data in a temporary folder."""

import os
import pwd
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from benchmarks.support.ports import free_ports, listens

PLACES = [
    *os.get_exec_path(),
    "/usr/sbin",
    *sorted(map(str, Path("/usr/lib/postgresql").glob("*/bin")), reverse=True),
]
PATIENCE_S = 60


class MissingProgramError(Exception):
    """A database server is not installed."""


class Server:
    """A database server that can be killed and started again.

    Attributes:
        url: Its URL, without the name of a database.
    """

    def __init__(
        self,
        url: str,
        command: list[str],
        folder: Path,
        user: str | None,
        stop: signal.Signals,
        ready: list[str],
    ) -> None:
        """`ready` is a command that succeeds once the server that answers takes connections as well."""
        self.url = url
        self._command, self._folder, self._user, self._stop, self._ready = command, folder, user, stop, ready
        self._process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        """Start it, again if what was killed is still going, until it answers."""
        port = int(self.url.rpartition(":")[2])
        end = time.monotonic() + PATIENCE_S
        while not (self._running() and listens(port) and not subprocess.run(self._ready).returncode):
            if time.monotonic() > end:
                raise RuntimeError(
                    f"{self._command[0]} does not start:\n{(self._folder / 'log').read_text()}"
                )
            if not self._running():
                with (self._folder / "log").open("ab") as log:
                    self._process = subprocess.Popen(
                        self._command,
                        stdout=log,
                        stderr=log,
                        cwd=self._folder,
                        env=_own(self._folder),
                        user=self._user,
                        group=self._user,
                    )
            time.sleep(0.05)

    def _running(self) -> bool:
        return self._process is not None and self._process.poll() is None

    def stop(self) -> None:
        """Stop it without waiting for connections."""
        self._end(self._stop)

    def kill(self) -> None:
        """Kill it on the spot."""
        self._end(signal.SIGKILL)

    def _end(self, how: signal.Signals) -> None:
        if self._process is not None:
            self._process.send_signal(how)
            self._process.wait(PATIENCE_S)
            self._process = None


@contextmanager
def mariadb(place: Path | None = None) -> Iterator[Server]:
    """A running MariaDB, with its data in a new folder at a place."""
    with _folder("mysql", place) as (folder, user):
        (port,) = free_ports(1)
        data = f"--datadir={folder / 'data'}"
        _run([_program("mariadb-install-db"), "--no-defaults", data, "--skip-test-db"], folder, user)
        (folder / "init.sql").write_text(
            "CREATE USER study@'127.0.0.1' IDENTIFIED BY 'secret';\nGRANT ALL ON *.* TO study@'127.0.0.1';\n"
        )
        command = [_program("mariadbd"), "--no-defaults", data, f"--port={port}", "--bind-address=127.0.0.1"]
        command += [
            f"--socket={folder / 'socket'}",
            f"--init-file={folder / 'init.sql'}",
            "--skip-name-resolve",
        ]
        url = f"mysql://study:secret@127.0.0.1:{port}"
        with _running(Server(url, command, folder, user, signal.SIGTERM, ["true"])) as server:
            yield server


@contextmanager
def postgresql(place: Path | None = None) -> Iterator[Server]:
    """A running PostgreSQL, with its data in a new folder at a place."""
    with _folder("postgres", place) as (folder, user):
        (port,) = free_ports(1)
        data = str(folder / "data")
        _run([_program("initdb"), "-D", data, "-A", "trust", "-U", "study", "-E", "UTF8"], folder, user)
        command = [_program("postgres"), "-D", data, "-p", str(port), "-c", "listen_addresses=127.0.0.1"]
        command += ["-c", f"unix_socket_directories={folder}"]
        url = f"postgresql://study@127.0.0.1:{port}"
        ready = [_program("pg_isready"), "-q", "-h", "127.0.0.1", "-p", str(port)]
        with _running(Server(url, command, folder, user, signal.SIGINT, ready)) as server:
            yield server


SERVERS = {"mariadb": mariadb, "postgresql": postgresql}


@contextmanager
def _folder(owner: str, place: Path | None) -> Iterator[tuple[Path, str | None]]:
    """A temporary folder, and the server's own user where root runs the tests: servers refuse root."""
    user = None
    if os.geteuid() == 0:
        try:
            user = pwd.getpwnam(owner).pw_name
        except KeyError as error:
            raise MissingProgramError(f"there is no user {owner!r}") from error
    folder = Path(tempfile.mkdtemp(prefix="database-", dir=place))
    try:
        if user is not None:
            shutil.chown(folder, user)
        yield folder, user
    finally:
        shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def _running(server: Server) -> Iterator[Server]:
    try:
        server.start()
        yield server
    finally:
        server.stop()


def _run(command: list[str], folder: Path, user: str | None) -> None:
    done = subprocess.run(
        command, capture_output=True, text=True, cwd=folder, env=_own(folder), user=user, group=user
    )
    if done.returncode:
        raise RuntimeError(f"{command} failed:\n{done.stdout}{done.stderr}")


def _own(folder: Path) -> dict[str, str]:
    """A server of MariaDB that starts deletes the temporary tables of others from a folder that they share."""
    return {**os.environ, "TMPDIR": str(folder)}


def _program(name: str) -> str:
    for place in PLACES:
        if (Path(place) / name).is_file():
            return str(Path(place) / name)
    raise MissingProgramError(f"{name} is not installed")
