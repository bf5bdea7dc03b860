"""`mjsim play` with scripted workers, served to a test client."""

import argparse
import functools
from contextlib import contextmanager

import numpy as np
from scripted_workers import ORIGIN
from starlette.testclient import TestClient
from study_database import new_database
from study_site import MadeInItsLoop

from experiments.cli import play
from experiments.cli.play_plan import NAME, plan_of_play
from experiments.visit.folders import VisitFolders
from experiments.visit.procedure import Procedure
from experiments.visit.server.app import ServerOptions, VisitServer
from experiments.visit.store import Store


def arguments_of(*words):
    """Arguments of the command, as the command line gives them."""
    parser = argparse.ArgumentParser()
    play.add_parser(parser.add_subparsers())
    return parser.parse_args(["play", *words])


@functools.cache
def planned(*words):
    """Arguments and plan of `mjsim play WORDS`, which nobody changes. A plan reads a house and all texts."""
    arguments = arguments_of(*words)
    task, questions = play.task_of(arguments), play.questions_of(arguments)
    return arguments, plan_of_play(arguments, task, play.shown_phases(arguments), questions)


def play_app(folder, pool, *words, sessions=20, made=lambda _: None):
    """The application that `mjsim play WORDS` serves; `made` gets the server."""
    arguments, plan = planned(*words)
    folder.mkdir(exist_ok=True)
    url = new_database(folder / "study.db")

    async def make():
        store = await Store.open(url, NAME, "0" * 64)
        procedure = Procedure(plan, store, VisitFolders(folder), np.random.default_rng(0))
        await procedure.adopt()
        server = VisitServer(
            procedure, pool, ServerOptions(proxies=arguments.trusted_proxy, workers=sessions)
        )
        made(server)
        return server.app("127.0.0.1", arguments.public_url)

    return MadeInItsLoop(make)


@contextmanager
def playing(folder, pool, *words, sessions=20):
    """A client of `mjsim play WORDS` with its `server`; `release` ends all sessions."""
    servers = []
    app = play_app(folder, pool, *words, sessions=sessions, made=servers.append)
    with TestClient(app, base_url=ORIGIN, follow_redirects=False) as client:
        client.server = servers[0]
        client.release = servers[0].sessions.release
        yield client


def send(client, link, phase, **form):
    """Submit the form of a phase."""
    return client.post(link, data={"phase": phase, **form}, headers={"Origin": ORIGIN})


def begin(client, read=True, **form):
    """Begin a visit and, with `read`, read the story; its link."""
    answer = client.post("/begin", headers={"Origin": ORIGIN}, data=form)
    assert answer.status_code == 303
    link = answer.headers["location"]
    if read and 'value="story"' in client.get(link).text:
        assert send(client, link, "story").status_code == 303
    return link
