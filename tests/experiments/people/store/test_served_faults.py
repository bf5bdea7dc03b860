"""Faults while people answer over real HTTP: another program finds what was acknowledged in the database, once."""

import asyncio
import json
import os

import numpy as np
import pytest
from sqlalchemy import create_engine, make_url, text

from benchmarks.support.study_people import ask, study_process
from experiments.people.study_file import read_people_study

PEOPLE = 4
MANY = int(os.environ.get("MJSIM_FAULTS", "6"))  # for each database
FEW = 4
SYNC = {"sqlite": "sqlite", "mysql": "mysql+pymysql", "postgresql": "postgresql+psycopg"}
KIND = {"mysql": "mariadb", "postgresql": "postgresql"}


class Answering:
    """A person who keeps changing answers to questions; `sent` and `kept` are numbers of answers by item."""

    def __init__(self, server, number, items, rng):
        self._server, self._number, self._rng = server, number, rng
        self.items, self.link = {item.name: item for item in items}, ""
        self.cut = set()  # may still be taken, however late
        self.sent, self.kept = dict.fromkeys(self.items, 0), dict.fromkeys(self.items, 0)

    def value(self, item, number):
        """The answer with a number."""
        choices = self.items[item].choices
        return choices[number % len(choices)]

    async def begin(self):
        self.link = (await ask(self._server.url, "/begin", {}, self._number)).headers["location"]
        assert (await self._post("", phase="consent", agree="yes")).status == 303
        assert 'value="comprehension"' in (await ask(self._server.url, self.link, None, self._number)).body

    async def answer_until(self, over):
        while not over.is_set():
            item = str(self._rng.choice(list(self.items)))
            self.sent[item] += 1
            given = self.sent[item]
            sending = asyncio.create_task(
                self._post("/answers", phase="comprehension", **{item: self.value(item, given)})
            )
            if self._rng.random() < 0.1:  # the connection is cut
                await asyncio.sleep(float(self._rng.uniform(0.0, 0.02)))
                sending.cancel()
                self.cut.add((item, given))
            try:
                if (await sending).status == 204:
                    self.kept[item] = given
            except (OSError, asyncio.CancelledError):
                await asyncio.sleep(0.05)

    async def send_twice(self, answers):
        """Send right answers twice at the same moment, until it is taken."""
        for _ in range(100):
            try:
                pair = await asyncio.gather(
                    *(self._post("", phase="comprehension", **answers) for _ in range(2))
                )
            except OSError:
                pair = []
            if any(answer.status == 303 for answer in pair):
                return
            await asyncio.sleep(0.2)
        pytest.fail("the answers were never taken")

    async def _post(self, path, **form):
        return await ask(self._server.url, self.link + path, form, self._number)


def rows(url, query):
    """What another program reads, without the store."""
    parsed = make_url(url)
    engine = create_engine(parsed.set(drivername=SYNC[parsed.get_backend_name()]))
    with engine.connect() as connection:
        found = [tuple(row) for row in connection.execute(text(query))]
    engine.dispose()
    return found


async def go_through(server, database, url, items, count, rng):
    people = [Answering(server, number, items, rng) for number in range(PEOPLE)]
    for person in people:
        await person.begin()
    faults = ["server", *(["database"] if database else []), "nothing"]
    for number in range(count):
        over = asyncio.Event()
        answering = [asyncio.create_task(person.answer_until(over)) for person in people]
        await asyncio.sleep(float(rng.uniform(0.3, 1.0)))
        fault = faults[number % len(faults)]
        if fault == "server":
            await asyncio.to_thread(server.kill)
            await asyncio.to_thread(server.start)
        elif fault == "database":
            await asyncio.to_thread(database.kill)
            await asyncio.to_thread(database.start)
        over.set()
        await asyncio.gather(*answering)
        check(url, people)
    last = {item.name: item.right for item in items}
    await asyncio.gather(*(person.send_twice(last) for person in people))
    return people


def check(url, people):
    """Each answer is the last that was acknowledged, or one that was sent after it."""
    query = (
        "SELECT person.id, item, value FROM answer JOIN person ON person.id = answer.person_id "
        "WHERE answer.phase = 'comprehension' ORDER BY person.id"
    )
    found = {(who, item): json.loads(value) for who, item, value in rows(url, query)}
    known = [who for (who,) in rows(url, "SELECT id FROM person ORDER BY id")]
    for who, person in zip(known, people, strict=True):
        for item, kept in person.kept.items():
            if kept:
                may = {person.value(item, number) for number in range(kept, person.sent[item] + 1)}
                may |= {person.value(*one) for one in person.cut if one[0] == item}
                assert found[who, item] in may, f"an acknowledged answer of person {who} is lost"


@pytest.mark.parametrize("count", [FEW, pytest.param(MANY, marks=pytest.mark.slow)])
def test_what_was_acknowledged_is_kept_once(tmp_path, url, count, request):
    kind = KIND.get(make_url(url).get_backend_name())
    database = request.getfixturevalue(kind) if kind else None
    rng = np.random.default_rng(count)
    phases = ("consent", "comprehension", "task", "completion")
    with study_process(tmp_path, "--database", url, phases=phases) as server:
        study = read_people_study(tmp_path / "study.toml")
        items = study.texts["comprehension"].items
        people = asyncio.run(go_through(server, database, url, items, count, rng))
    assert rows(url, "SELECT phase FROM person") == [("task",)] * PEOPLE
    doubled = "SELECT person_id, phase, item FROM answer GROUP BY person_id, phase, item HAVING COUNT(*) > 1"
    assert rows(url, doubled) == []
    final = rows(url, "SELECT item, value FROM answer WHERE phase = 'comprehension' AND final")
    right = sorted((item.name, item.right) for item in items)
    assert sorted((item, json.loads(value)) for item, value in final if item != "attempts") == sorted(
        right * PEOPLE
    )
    assert sum(sum(person.kept.values()) for person in people) > 0
    assert "Traceback" not in server.output.read_text()
