"""MariaDB and PostgreSQL as processes of their own, on a free port, with their data in a temporary folder."""

import os
import pwd
import shutil
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
    with _folder("mysql") as folder:
        port = _free_port()
        user = ["--user=mysql"] if os.geteuid() == 0 else []
        data = f"--datadir={folder / 'data'}"
        _run([_program("mariadb-install-db"), "--no-defaults", data, *user, "--skip-test-db"])
        (folder / "init.sql").write_text(
            "CREATE USER study@'127.0.0.1' IDENTIFIED BY 'secret';\nGRANT ALL ON *.* TO study@'127.0.0.1';\n"
        )
        command = [
            _program("mariadbd"),
            "--no-defaults",
            data,
            *user,
            f"--port={port}",
            "--bind-address=127.0.0.1",
        ]
        command += [
            f"--socket={folder / 'socket'}",
            f"--init-file={folder / 'init.sql'}",
            "--skip-name-resolve",
        ]
        with _running(command, port, folder):
            yield f"mysql://study:secret@127.0.0.1:{port}"


@contextmanager
def postgresql() -> Iterator[str]:
    """URL of a running PostgreSQL, without the name of a database."""
    with _folder("postgres") as folder:
        port = _free_port()
        user = [_program("runuser"), "-u", "postgres", "--"] if os.geteuid() == 0 else []
        data = str(folder / "data")
        _run([*user, _program("initdb"), "-D", data, "-A", "trust", "-U", "study", "-E", "UTF8"])
        command = [
            *user,
            _program("postgres"),
            "-D",
            data,
            "-p",
            str(port),
            "-c",
            "listen_addresses=127.0.0.1",
        ]
        with _running([*command, "-c", f"unix_socket_directories={folder}"], port, folder):
            yield f"postgresql://study@127.0.0.1:{port}"


SERVERS = {"mariadb": mariadb, "postgresql": postgresql}


@contextmanager
def _folder(owner: str) -> Iterator[Path]:
    """A temporary folder that belongs to a server's own user where root runs the tests: servers refuse root."""
    folder = Path(tempfile.mkdtemp(prefix="database-"))
    try:
        if os.geteuid() == 0:
            try:
                user = pwd.getpwnam(owner)
            except KeyError as error:
                raise MissingProgramError(f"there is no user {owner!r}") from error
            os.chown(folder, user.pw_uid, user.pw_gid)
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def _running(command: list[str], port: int, folder: Path) -> Iterator[None]:
    with (
        (folder / "log").open("wb") as log,
        subprocess.Popen(command, stdout=log, stderr=log, cwd=folder) as server,
    ):
        try:
            end = time.monotonic() + PATIENCE_S
            while not _answers(port):
                if server.poll() is not None or time.monotonic() > end:
                    raise RuntimeError(f"{command[0]} does not start:\n{(folder / 'log').read_text()}")
                time.sleep(0.05)
            yield
        finally:
            server.terminate()
            server.wait(PATIENCE_S)


def _answers(port: int) -> bool:
    with closing(socket.socket()) as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


def _free_port() -> int:
    with closing(socket.socket()) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def _run(command: list[str]) -> None:
    done = subprocess.run(command, capture_output=True, text=True, cwd="/")
    if done.returncode:
        raise RuntimeError(f"{command} failed:\n{done.stdout}{done.stderr}")


def _program(name: str) -> str:
    for place in PLACES:
        if (Path(place) / name).is_file():
            return str(Path(place) / name)
    raise MissingProgramError(f"{name} is not installed")
