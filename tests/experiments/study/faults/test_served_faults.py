"""Faults while people answer, play and are paid: nothing that was acknowledged is lost, and nothing counts twice.

`MJSIM_FAULTS=200` tries so many on each database.
"""

import asyncio
import json
import math
import os
import signal
import time
from collections import Counter
from contextlib import suppress

import numpy as np
import pytest
from database_servers import MissingProgramError

from benchmarks.support.play_server import PATIENCE, worker_of
from tests.experiments.study.faults.participants import RIGHT_ANSWERS, Answering, Person, Playing
from tests.experiments.study.faults.site import NAMES, running_site
from tests.experiments.study.platforms.emulator import SECRET
from tests.experiments.study.platforms.prolific import Prolific

FAULTS_OF_A_GROUP = 10  # of people
AHEAD = 3 * 3600.0  # s that a clock is wrong at most
AFTERWARDS = 3  # answers or inputs that are acknowledged once somebody goes on
LONG_AGO = 15.0  # s after which no payment is on its way any more
SHARE = 450  # cents, for two phases of four
TROUBLES = ("500 before", "500 after", "garbage before", "garbage after")  # of the platform


class Trial:
    """People and faults on a site; `took` is how long everybody needed to go on, s, by kind of fault."""

    def __init__(self, site, seed):
        self._site, self._seed = site, seed
        self._rng = np.random.default_rng(seed)
        self._people, self._answering, self._playing = [], [], []
        self.took = []

    async def go(self, faults):
        for first in range(0, len(faults), FAULTS_OF_A_GROUP):
            await self._group(faults[first : first + FAULTS_OF_A_GROUP])
        await asyncio.to_thread(self._pay_all)
        self._check()
        self._check_end()

    async def _group(self, faults):
        self._answering = [self._person(Answering) for _ in range(2)]
        self._playing = [self._person(Playing) for _ in range(2)]
        both = [*self._answering, *self._playing]
        await asyncio.gather(*(person.begin() for person in both))
        async with asyncio.TaskGroup() as group:
            doing = [group.create_task(person.go_on()) for person in both]
            await self._everybody_goes_on()
            for fault in faults:
                began = time.monotonic()
                await self._disturb(fault)
                self.took.append((fault.__name__, time.monotonic() - began))
                print(f"{len(self.took)}: {fault.__name__} {self.took[-1][1]:.1f} s", flush=True)
            for task in doing:
                task.cancel()
        await asyncio.gather(*(person.understand() for person in self._answering for _ in range(2)))
        await asyncio.gather(*(person.leave() for person in both))
        self._site.let_time_pass(LONG_AGO)

    async def _disturb(self, fault):
        """Somebody goes through the study while it happens."""
        through = self._person(Person, twice=fault is Trial.double_submit)
        going = asyncio.create_task(through.go_through())
        if self._rng.random() < 0.3:
            self._site.platform.faults.append(str(self._rng.choice(TROUBLES)))
        await asyncio.sleep(float(self._rng.uniform(0.0, 0.5)))
        await fault(self)
        await going
        await self._everybody_goes_on()
        self._check()

    async def kill_of_a_server(self):
        """Its program that pays is killed with it, perhaps as it waits for the platform."""
        host, when = self._a_host(), str(self._rng.choice(["before", "after"]))
        self._site.platform.faults.append(f"hang {when}")
        await asyncio.sleep(float(self._rng.uniform(0.0, 1.0)))
        await asyncio.to_thread(host.kill)
        self._site.platform.faults.clear()
        await asyncio.to_thread(host.start)

    async def kill_of_a_worker(self):
        journal = self._playing[int(self._rng.integers(2))].journal()
        async with asyncio.timeout(PATIENCE):
            while not (worker := _worker_of(journal)):
                await asyncio.sleep(0.1)
        os.kill(worker, signal.SIGKILL)

    async def kill_of_the_database(self):
        await asyncio.to_thread(self._site.kill_database)

    async def full_disk(self):
        with self._site.full_disk():
            await asyncio.sleep(1.0)
        assert all(host.runs() for host in self._site.hosts.values())

    async def clock_step(self):
        self._a_host().set_clock(float(self._rng.uniform(-AHEAD, AHEAD)))

    async def cut(self):
        for person in self._playing:
            person.lose(amid_a_message=bool(self._rng.integers(2)))

    async def double_submit(self):
        """The person who goes through sends everything twice."""

    async def two_hosts(self):
        await asyncio.to_thread(self._site.hand_over, self._a_host().name)

    def _person(self, kind, **more):
        self._people.append(kind(self._site, len(self._people), self._seed, **more))
        return self._people[-1]

    def _a_host(self):
        return self._site.hosts[str(self._rng.choice(NAMES))]

    async def _everybody_goes_on(self):
        before = [(person, person.noted + AFTERWARDS) for person in (*self._answering, *self._playing)]
        try:
            async with asyncio.timeout(PATIENCE):
                while any(person.noted <= noted for person, noted in before):
                    await asyncio.sleep(0.02)
        except TimeoutError:
            stuck = [person for person, noted in before if person.noted <= noted]
            raise AssertionError(f"{[vars(person) for person in stuck]} do not go on") from None

    def _check(self):
        query = "SELECT token_hash, item, value FROM answer JOIN person ON person.id = answer.person_id"
        rows = self._site.rows(f"{query} WHERE answer.phase = 'comprehension'")
        found = {(name, item): json.loads(value) for name, item, value in rows}
        for person in self._answering:
            if not person.left:
                person.check(found)
        for person in self._playing:
            person.check()
        known = dict(self._site.rows("SELECT token_hash, status FROM person"))
        assert all(known[person.name] == "withdrawn" for person in self._people if person.left)
        assert not [one for one in self._site.platform.paid().items() if one[1] > 1], "paid twice"
        said = self._said_to_be_paid()
        noted = self._site.rows("SELECT payment.key FROM payment WHERE event = 'confirmed'")
        assert {(key,) for key in said} <= set(noted)

    def _said_to_be_paid(self):
        lines = [
            line.split("  ")
            for host in self._site.hosts.values()
            for line in host.paid.read_text().splitlines()
        ]
        return [line[0] for line in lines if len(line) == 3 and line[1] == "paid"]

    def _pay_all(self):
        self._site.platform.faults.clear()
        end = time.monotonic() + LONG_AGO + PATIENCE
        while len(self._site.platform.paid()) < len(self._people) or not self._all_is_noted():
            assert time.monotonic() < end, (self._site.platform.paid(), len(self._people))
            self._site.let_time_pass(LONG_AGO)
            time.sleep(1.0)

    def _all_is_noted(self):
        (noted,) = self._site.rows("SELECT COUNT(*) FROM payment WHERE event = 'confirmed'")[0]
        return noted >= len(self._people)

    def _check_end(self):
        """One row of everybody, three final answers, one payment of the share."""
        site, count = self._site, len(self._people)
        assert sorted(site.rows("SELECT token_hash FROM person")) == sorted(
            (one.name,) for one in self._people
        )
        final = site.rows("SELECT person_id, item, value FROM answer WHERE phase = 'comprehension' AND final")
        found = Counter((person, item) for person, item, _ in final if item in RIGHT_ANSWERS)
        assert len(found) == 3 * count and set(found.values()) == {1}
        assert {json.loads(value) for _, item, value in final if item in RIGHT_ANSWERS} == {"right"}
        shown = Counter(site.rows("SELECT person_id, name FROM phase"))
        assert set(shown.values()) == {1}
        paid = site.platform.paid()
        assert len(paid) == count and set(paid.values()) == {1} and {cents for _, cents in paid} == {SHARE}
        events = Counter(site.rows("SELECT payment.key, event FROM payment WHERE event <> 'sending'"))
        assert sum(1 for _, event in events if event == "confirmed") == count
        assert all(number == 1 for (_, event), number in events.items() if event != "failed")
        for host in site.hosts.values():
            assert "Exception in ASGI application" not in host.server.output.read_text()
            # SQLAlchemy's pool logs a traceback of its own where a rollback meets a killed database.
            assert "experiments/cli" not in host.paid.with_suffix(".errors").read_text()


def _worker_of(journal):
    """The worker that plays; None while there is none."""
    with suppress(ChildProcessError):
        return worker_of(journal)


KINDS = (
    Trial.kill_of_a_server,
    Trial.kill_of_a_worker,
    Trial.kill_of_the_database,
    Trial.full_disk,
    Trial.clock_step,
    Trial.cut,
    Trial.double_submit,
    Trial.two_hosts,
)
MANY = int(os.environ.get("MJSIM_FAULTS", "4"))  # for each database


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize(("kind", "seed"), [("sqlite", 1), ("mariadb", 2), ("postgresql", 3)])
def test_what_was_acknowledged_is_kept_once(tmp_path, monkeypatch, kind, seed):
    monkeypatch.setenv(Prolific.variable, SECRET)
    monkeypatch.setenv("MJSIM_STUDY_SECRET", "the same on all hosts")
    try:
        with Prolific().running() as platform, running_site(tmp_path, platform, kind) as site:
            kinds = [fault for fault in KINDS if site.can_be_full or fault is not Trial.full_disk]
            of_each = math.ceil(MANY / len(kinds))
            faults = list(np.random.default_rng(seed).permutation(kinds * of_each))[:MANY]
            trial = Trial(site, seed)
            asyncio.run(trial.go(faults))
    except MissingProgramError as reason:
        pytest.skip(str(reason))
    for name in sorted({name for name, _ in trial.took}):
        seconds = [taken for fault, taken in trial.took if fault == name]
        print(f"{name}: {len(seconds)}, {np.median(seconds):.1f} s, at most {max(seconds):.1f} s")
