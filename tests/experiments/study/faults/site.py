"""A study on two hosts: servers, programs that pay, a database, and a disk that can be full."""

import os
import shutil
import subprocess
import sys
import tempfile
from contextlib import ExitStack, contextmanager, suppress
from datetime import timedelta
from pathlib import Path

from database_servers import SERVERS
from sqlalchemy import create_engine, make_url, select, text, update

from benchmarks.support.play_server import PATIENCE, PlayProcess
from benchmarks.support.study_people import PROXIED, ask
from experiments.cli.main import main
from experiments.record.journal import JOURNAL
from experiments.record.phases import TASK
from experiments.record.run_directory import JOURNALS
from experiments.visit.folders import VISITS
from experiments.visit.store.tables import payment
from experiments.visit.store.values import utc_now

NAMES = ("one", "two")
DISK = 800  # MB
ANSWER_S = 20.0  # for an answer
PAY_PERIOD = 1.0  # s between two times that all that is owed is paid
WRONG_CLOCK = Path(__file__).with_name("wrong_clock.py")
SYNC = {"sqlite": "sqlite", "mysql": "mysql+pymysql", "postgresql": "postgresql+psycopg"}
QUESTIONS = ("first", "second", "third")
RIGHT = "right"
TEXTS = "".join(
    f'[[comprehension.item]]\nname = "{name}"\nkind = "line"\ntext = "?"\nright = "{RIGHT}"\n'
    for name in QUESTIONS
)
STUDY = """
[[cells]]
assistance = "none"
objects = 1
people = 1000
house_seeds = 0
fidelity = "event"
time_limit = 86400

[study]
name = "faults"
title = "A study"
institution = "a test"
contact = "nobody@example.org"
phases = ["consent", "comprehension", "task", "completion"]
texts = "texts.toml"

[study.pay]
reward = 9.00
partial = true

[study.recruitment]
platform = "prolific"
completed = "C0MPLETE"
screened_out = "SCREEN0UT"
no_consent = "N0C0NSENT"
sites = ["{url}"]
api_url = "{url}"
"""


class Host:
    """A server of the study, and a program that pays again and again, both with the host's clock."""

    def __init__(self, name, site):
        self.name, self.folder = name, site.disk / name
        self._site, self._clock = site, site.folder / f"{name}.clock"
        self.set_clock(0.0)
        self._paying = None
        self.paid = site.folder / f"{name}.paid.txt"
        self._program = (sys.executable, str(WRONG_CLOCK), str(self._clock))
        words = (*PROXIED, "--workers", "50", "--database", site.url, "--host-name", name)
        command = ("study", "serve", str(site.file))
        self.server = PlayProcess(self.folder, *words, command=command, program=(*self._program, "0"))
        self.server.output = site.folder / f"{name}.server.txt"  # not on the disk that is full

    def set_clock(self, seconds):
        """Let the clock be so much ahead."""
        new = self._clock.with_suffix(".new")
        new.write_text(str(seconds))
        new.replace(self._clock)

    def start(self):
        self.server.start()
        if self._paying is None:
            self._paying = self._pay()

    def kill(self):
        self._end_paying()
        self.server.kill()

    def stop(self):
        """Stop the server; payments go on."""
        self.server.process.terminate()
        self.server.process.communicate(timeout=PATIENCE)

    def end(self):
        self._end_paying()
        self.stop()

    def _pay(self):
        words = ("study", "pay", str(self._site.file), str(self.folder), "--send", "--without-rehearsal")
        with self.paid.open("ab") as out, self.paid.with_suffix(".errors").open("ab") as errors:
            return subprocess.Popen(
                [*self._program, str(PAY_PERIOD), *words, "--database", self._site.url],
                stdout=out,
                stderr=errors,
            )

    def _end_paying(self):
        self._paying.kill()
        self._paying.wait()
        self._paying = None

    def runs(self):
        return self.server.process.poll() is None and self._paying is not None and self._paying.poll() is None

    def journal(self, name):
        """Where the journal of a visit is if it is here."""
        return self.folder / VISITS / name / JOURNALS / TASK / JOURNAL


class Site:
    """All of it.

    Attributes:
        hosts: By name.
        disk: Holds what the hosts and the database keep.
        database: The server of the database; None for SQLite.
        can_be_full: Whether the disk is one of its own.
    """

    def __init__(self, folder, disk, platform, database, *, can_be_full):
        self.folder, self.disk, self.platform, self.database = folder, disk, platform, database
        self.can_be_full = can_be_full
        self.file = folder / "study.toml"
        self.file.write_text(STUDY.format(url=platform.url))
        (folder / "texts.toml").write_text(TEXTS)
        self.url = f"sqlite:///{disk / 'study.db'}" if database is None else self._new_database()
        self.hosts = {name: Host(name, self) for name in NAMES}

    def _new_database(self):
        home = make_url(self.database.url)
        kind = home.get_backend_name()
        home = home.set(drivername=SYNC[kind], database="postgres" if kind == "postgresql" else None)
        engine = create_engine(home, isolation_level="AUTOCOMMIT")
        with engine.connect() as connection:
            connection.execute(text("CREATE DATABASE faults"))
        engine.dispose()
        return f"{self.database.url}/faults"

    def rows(self, query):
        """What another program reads from the database."""
        with self._connected() as connection:
            return [tuple(row) for row in connection.execute(text(query))]

    def let_time_pass(self, seconds):
        """Let hours pass for payments whose last event is so many seconds ago."""
        before = utc_now() - timedelta(seconds=seconds)
        with self._connected() as connection:
            earlier = [
                (row.id, row.at - timedelta(hours=2))
                for row in connection.execute(select(payment))
                if row.at < before
            ]
            for number, at in earlier:
                connection.execute(update(payment).where(payment.c.id == number).values(at=at))
            connection.commit()

    @contextmanager
    def _connected(self):
        parsed = make_url(self.url)
        engine = create_engine(parsed.set(drivername=SYNC[parsed.get_backend_name()]))
        with engine.connect() as connection:
            yield connection
        engine.dispose()

    async def ask(self, path, form, number, rng, host=None):
        """Ask a host as a proxy does, which asks the next one where the first does not listen or has no such person."""
        answer = None
        for name in [host] if host else rng.permutation(NAMES):
            with suppress(ConnectionRefusedError):
                answer = await ask(self.hosts[name].server.url, path, form, number, patience=ANSWER_S)
                if answer.status != 404:
                    return answer, self.hosts[name]
        if answer is None:
            raise ConnectionRefusedError
        return answer, None

    def kill_database(self):
        """Kill it, and start it; where it has no server, all that have its file open are killed."""
        if self.database is not None:
            self.database.kill()
            self.database.start()
            return
        for host in self.hosts.values():
            host.kill()
        for host in self.hosts.values():
            host.start()

    @contextmanager
    def full_disk(self):
        """No room on the disk meanwhile."""
        filler = self.disk / "filler"
        try:
            with filler.open("wb", buffering=0) as file, suppress(OSError):
                while True:
                    room = os.statvfs(self.disk)
                    os.posix_fallocate(file.fileno(), file.tell(), max(room.f_bavail * room.f_frsize, 4096))
                    file.seek(0, os.SEEK_END)
            yield
        finally:
            filler.unlink()
            if self.database is not None:
                self.database.start()

    def hand_over(self, name):
        """Stop a host for good, let the other one have its visits, and put another one in its place."""
        gone, other = self.hosts[name], next(host for host in self.hosts.values() if host.name != name)
        gone.stop()
        for visit in (gone.folder / VISITS).iterdir():
            shutil.move(visit, other.folder / VISITS / visit.name)
        words = ["hosts", str(self.file), str(gone.folder), "--hand-over", name, "--database", self.url]
        assert main(["study", *words]) == 0
        gone.start()


@contextmanager
def running_site(folder, platform, kind):
    """A site with a kind of database, until the context is left."""
    with ExitStack() as stack:
        disk = Path(tempfile.mkdtemp(prefix="disk-"))
        stack.callback(shutil.rmtree, disk, ignore_errors=True)
        disk.chmod(0o755)  # the servers of databases have users of their own
        mount = ["mount", "-t", "tmpfs", "-o", f"size={DISK}m,mode=755", "none", str(disk)]
        can_be_full = not subprocess.run(mount, capture_output=True, check=False).returncode
        if can_be_full:
            stack.callback(subprocess.run, ["umount", "--lazy", str(disk)], check=True)
        database = stack.enter_context(SERVERS[kind](disk)) if kind in SERVERS else None
        site = Site(folder, disk, platform, database, can_be_full=can_be_full)
        for host in site.hosts.values():
            host.start()
            stack.callback(host.end)
        yield site
