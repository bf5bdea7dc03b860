"""A study with its researcher's page, served over real HTTP on two ports; trials are played by scripted workers."""

import asyncio
import re
import threading
from contextlib import contextmanager
from dataclasses import dataclass, field
from ipaddress import ip_network
from typing import Any

import httpx
import numpy as np
from scripted_workers import ScriptedPool
from study_database import new_database

from experiments.cli.server import http_server, listen, url_of
from experiments.study.file import read_people_study
from experiments.study.plan import plan_of
from experiments.study.researcher.app import ResearcherContext, ResearcherServer
from experiments.study.researcher.metrics import ServerMetrics, Timed
from experiments.visit.folders import VisitFolders
from experiments.visit.procedure import Procedure
from experiments.visit.server.app import ServerOptions, VisitServer
from experiments.visit.store import Store

HOST = "127.0.0.1"
PASSWORD = "correct horse battery"
ROLES = ("viewer", "assistant", "owner")  # names of researchers as well
CELLS = """
[[cells]]
assistance = "optimal"
objects = 1
people = 40
house_seeds = 0

[study]
name = "small"
title = "A small study"
institution = "a test"
contact = "nobody@example.org"
"""


@dataclass
class Site:
    """What is served. `people` and `researchers` are the two applications."""

    study: Any
    pool: ScriptedPool = field(default_factory=ScriptedPool)
    url: str = ""
    researcher_url: str = ""
    store: Any = None
    people: Any = None
    researchers: Any = None
    loop: Any = None
    logins: int = 0

    def ask(self, coroutine):
        """What a coroutine of the store gives."""
        return asyncio.run_coroutine_threadsafe(coroutine, self.loop).result(60)

    def client(self, researcher=False, headers=None):
        """A browser, without anything in it yet."""
        url = self.researcher_url if researcher else self.url
        origin = {"Origin": url.rstrip("/"), **(headers or {})}
        return httpx.Client(base_url=url, headers=origin, timeout=60, follow_redirects=False)

    def logged_in(self, name):
        """The browser of a researcher, each at an address of its own."""
        self.logins += 1
        client = self.client(researcher=True, headers={"X-Forwarded-For": f"198.51.100.{self.logins}"})
        answer = client.post("/login", data={"name": name, "password": PASSWORD})
        assert (answer.status_code, answer.headers["location"]) == (303, "/")
        return client

    def begin(self, client, **ids):
        """Begin the study as a new person; the path of the link."""
        answer = client.post("/begin", data=ids)
        assert answer.status_code == 303, answer.text
        return answer.headers["location"]


class MadeInItsLoop:
    """An application that is made in the event loop in which it runs, as its database has to be."""

    def __init__(self, make):
        self._make, self._app = make, None

    async def __call__(self, scope, receive, send):
        self._app = self._app or await self._make()
        await self._app(scope, receive, send)


@contextmanager
def served(folder, settings="", researchers=ROLES, workers=20):
    """A study with `settings` added to its file, and researchers of these names and roles."""
    (folder / "study.toml").write_text(CELLS + settings)
    (folder / "film.mp4").write_bytes(b"a film")
    url = new_database(folder / "study.db")
    site, ready, servers = Site(read_people_study(folder / "study.toml")), threading.Event(), []
    failed = []

    async def main():
        site.loop = asyncio.get_running_loop()
        site.store = await Store.open(url, "small", "0" * 64, password_memory_kib=64)
        known = {one.name for one in await site.store.researchers.all()}
        for role in set(researchers) - known:
            await site.store.researchers.add(role, PASSWORD, role)
        metrics = ServerMetrics()
        site.store.on_write(metrics.wrote)
        folders, rng = VisitFolders(folder / "visits"), np.random.default_rng(0)
        procedure = Procedure(plan_of(site.study, folder / "film.mp4"), site.store, folders, rng)
        proxies = (ip_network("127.0.0.1/32"),)
        server = VisitServer(
            procedure, site.pool, ServerOptions(b"secret", proxies, metrics, workers=workers)
        )
        site.people = server.app(HOST)
        watched = ResearcherContext(site.study, site.store, server.sessions, metrics)
        site.researchers = ResearcherServer(watched, proxies=proxies).app(HOST)
        with listen(HOST, 0) as first, listen(HOST, 0) as second:
            site.url, site.researcher_url = url_of(first), url_of(second)
            servers.extend([http_server(Timed(site.people, metrics)), http_server(site.researchers)])
            ready.set()
            await asyncio.gather(servers[0].serve([first]), servers[1].serve([second]))

    def run():
        try:
            asyncio.run(main())
        except BaseException as error:
            failed.append(error)
            ready.set()

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    ready.wait(60)
    assert not failed, failed
    try:
        yield site
    finally:
        for server in reversed(servers):
            server.should_exit = True
        thread.join(60)
        assert not failed, failed


def phase_of(client, link):
    """Name of the phase whose page is shown; None where there is none."""
    found = re.search(r'name="phase" value="(\w+)"|data-trial="(\w+)"', client.get(link).text)
    return next(name for name in found.groups() if name) if found else None
