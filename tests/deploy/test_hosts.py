"""Two hosts with one database behind NGINX: one is killed, and its visits are handed to the other."""

import asyncio
import json
import shutil
import ssl

import httpx
import pytest
from nginx_site import STUDY, make_certificate, nginx_before
from scripted_workers import hello
from store_clock import at
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from benchmarks.support.play_server import PATIENCE, PlayProcess
from benchmarks.support.ports import free_ports
from experiments.visit.store import Store, utc_now
from experiments.visit.store.hosts import SILENT
from experiments.visit.tokens import token_hash

PEOPLE = 6
NOWHERE = (404, 502)  # whichever host NGINX asks last


class Played:
    """A person in the task, through NGINX."""

    def __init__(self, url, trusted):
        self._url, self._trusted = url, trusted
        self._client = httpx.Client(verify=trusted, base_url=url, headers={"Origin": url}, timeout=PATIENCE)
        self.link = self._client.post("/begin", data={}).headers["location"]
        self._client.post(self.link, data={"phase": "consent", "agree": "yes"})
        assert 'data-trial="task"' in self.page().text

    def page(self):
        return self._client.get(self.link)

    @property
    def name(self):
        return token_hash(self.link.rsplit("/", 1)[1])

    def press(self, count):
        """Send inputs until they are acknowledged; the number of the last input that the session had before."""
        address = self._url.replace("http", "ws", 1) + self.link
        with connect(address, ssl=self._trusted, origin=self._url, open_timeout=PATIENCE) as socket:
            socket.send(json.dumps(hello("task")))
            before = self._until(socket, lambda one: one.get("phase") in ("ready", "paused"))["input"]
            socket.send(json.dumps({"type": "run"}))
            self._until(socket, lambda one: one.get("phase") == "running")
            inputs = [{"number": before + 1 + i, "scroll": 1} for i in range(count)]
            socket.send(json.dumps({"type": "inputs", "inputs": inputs}))
            self._until(socket, lambda one: one["type"] == "taken" and one["input"] >= before + count)
        return before

    @staticmethod
    def _until(socket, holds):
        while not holds(one := json.loads(socket.recv(timeout=PATIENCE))):
            pass
        return one


@pytest.fixture
def certificate(tmp_path):
    return make_certificate(tmp_path)


@pytest.fixture
def hosts(tmp_path, certificate):
    """URL of NGINX before two hosts, and the hosts by name."""
    front, *ports = free_ports(3)
    (tmp_path / "study.toml").write_text(STUDY.replace("people = 2", "people = 20"))
    url = f"https://localhost:{front}"
    words = [
        "--public-url",
        url,
        "--trusted-proxy",
        "127.0.0.1",
        "--workers",
        "10",
        "--database",
        f"sqlite:///{tmp_path}/all.db",
    ]
    serve = ("study", "serve", str(tmp_path / "study.toml"))
    found = {}
    try:
        for name, port in zip(("one", "two"), ports, strict=True):
            (tmp_path / name).mkdir()
            own = ("--port", str(port), "--host-name", name)
            found[name] = PlayProcess(tmp_path / name / "out", *words, *own, command=serve)
            found[name].start()
        with nginx_before(tmp_path, ports, front, certificate):
            yield url, found
    finally:
        for host in found.values():
            host.process.terminate()
            host.process.communicate()


@pytest.mark.slow
def test_the_visits_of_a_killed_host_go_on_at_the_other(tmp_path, hosts, certificate):
    url, servers = hosts
    trusted = ssl.create_default_context(cafile=certificate[0])
    people = [Played(url, trusted) for _ in range(PEOPLE)]
    first = people[0]
    assert first.press(5) == 0
    assert first.press(5) == 5

    async def ask(work):
        store = await Store.open(f"sqlite:///{tmp_path}/all.db", "small", "0" * 64)
        try:
            return await work(store)
        finally:
            await store.close()

    def owners():
        return {one.token_hash: one.host for one in asyncio.run(ask(lambda store: store.people()))}

    before = owners()
    for person in people:  # its journal is where it belongs, and nowhere else
        found = [name for name in servers if (tmp_path / name / "out" / "visits" / person.name).is_dir()]
        assert found == [before[person.name]]
    lost = before[first.name]
    other = next(name for name in servers if name != lost)
    servers[lost].kill()
    assert first.page().status_code in NOWHERE, "nobody starts it anew"
    with pytest.raises(InvalidStatus):
        first.press(1)
    for person in people:
        if before[person.name] == lost:
            shutil.copytree(
                tmp_path / lost / "out" / "visits" / person.name,
                tmp_path / other / "out" / "visits" / person.name,
            )
    assert first.page().status_code in NOWHERE, "the lost host may still run"
    with at(utc_now() + SILENT):
        moved = asyncio.run(ask(lambda store: store.hand_over(lost, "ada")))
    assert moved == list(before.values()).count(lost)
    assert first.press(5) == 10, "what was acknowledged is there"
    assert all(person.page().status_code == 200 for person in people)
    assert set(owners().values()) == {other}
    servers[lost].start()  # with the old journals
    assert first.press(5) == 15
    assert all(person.page().status_code == 200 for person in people)
    assert set(owners().values()) == {other}
