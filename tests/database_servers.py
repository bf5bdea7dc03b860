"""MariaDB and PostgreSQL as processes of their own, on a free port, with their data in a temporary folder."""

import os
import pwd
import shutil
import signal
import socket
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

PLACES = [
    *os.get_exec_path(),
    "/usr/sbin",
    *sorted(map(str, Path("/usr/lib/postgresql").glob("*/bin")), reverse=True),
]
PATIENCE_S = 60


class MissingProgramError(Exception):
    """A database server is not installed."""


@contextmanager
def mariadb() -> Iterator[str]:
    """URL of a running MariaDB, without the name of a database."""
    with _folder("mysql") as (folder, user):
        port = _free_port()
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
        with _running(command, port, folder, user, signal.SIGTERM):
            yield f"mysql://study:secret@127.0.0.1:{port}"


@contextmanager
def postgresql() -> Iterator[str]:
    """URL of a running PostgreSQL, without the name of a database."""
    with _folder("postgres") as (folder, user):
        port = _free_port()
        data = str(folder / "data")
        _run([_program("initdb"), "-D", data, "-A", "trust", "-U", "study", "-E", "UTF8"], folder, user)
        command = [_program("postgres"), "-D", data, "-p", str(port), "-c", "listen_addresses=127.0.0.1"]
        command += ["-c", f"unix_socket_directories={folder}"]
        with _running(command, port, folder, user, signal.SIGINT):  # SIGTERM waits for connections
            yield f"postgresql://study@127.0.0.1:{port}"


SERVERS = {"mariadb": mariadb, "postgresql": postgresql}


@contextmanager
def _folder(owner: str) -> Iterator[tuple[Path, str | None]]:
    """A temporary folder, and the server's own user where root runs the tests: servers refuse root."""
    user = None
    if os.geteuid() == 0:
        try:
            user = pwd.getpwnam(owner).pw_name
        except KeyError as error:
            raise MissingProgramError(f"there is no user {owner!r}") from error
    folder = Path(tempfile.mkdtemp(prefix="database-"))
    try:
        if user is not None:
            shutil.chown(folder, user)
        yield folder, user
    finally:
        shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def _running(
    command: list[str], port: int, folder: Path, user: str | None, stop: signal.Signals
) -> Iterator[None]:
    log = folder / "log"
    with log.open("wb") as output:
        server = subprocess.Popen(command, stdout=output, stderr=output, cwd=folder, user=user, group=user)
    try:
        end = time.monotonic() + PATIENCE_S
        while not _answers(port):
            if server.poll() is not None or time.monotonic() > end:
                raise RuntimeError(f"{command[0]} does not start:\n{log.read_text()}")
            time.sleep(0.05)
        yield
    finally:
        server.send_signal(stop)
        server.wait(PATIENCE_S)


def _answers(port: int) -> bool:
    with closing(socket.socket()) as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


def _free_port() -> int:
    with closing(socket.socket()) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def _run(command: list[str], folder: Path, user: str | None) -> None:
    done = subprocess.run(command, capture_output=True, text=True, cwd=folder, user=user, group=user)
    if done.returncode:
        raise RuntimeError(f"{command} failed:\n{done.stdout}{done.stderr}")


def _program(name: str) -> str:
    for place in PLACES:
        if (Path(place) / name).is_file():
            return str(Path(place) / name)
    raise MissingProgramError(f"{name} is not installed")
