"""`mjsim study serve`: a study with people, from the first page to the last."""

import argparse
import asyncio
import functools
import os
import secrets
import socket
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

from experiments.cli.options import add_command
from experiments.cli.server import (
    add_server_options,
    check_public_url,
    listen,
    locked,
    number,
    prepare_process,
    serve,
)
from experiments.cli.study.database import DATABASE, add_database, people_study, sqlite_url
from experiments.errors import ConfigError
from experiments.record.phases import FLYTHROUGH

if TYPE_CHECKING:  # imported when the command runs, so that other commands start fast
    from experiments.study.file import Study
    from experiments.web.server.pool import WorkerPool

SECRET_FILE, FILM = "secret", "flythrough.mp4"
SECRET = "MJSIM_STUDY_SECRET"
DESCRIPTION = f"""\
Serve a study with people: consent, a check of the computer, the story, a film of the house, questions about the task,
training, task, survey, and the way back to where people came from. STUDY.toml is a design with a table [study]
(docs/study.md); `paper` is the published study. Prints the URL on a separate line and opens it.

Everything is kept in --out: the database, run directories and journals of trials, the film, and the secret from
which people who come from a platform are recognised ({SECRET} sets another one). Ctrl-C ends the server; the same
command continues the study, and everybody in it continues where they stopped."""


def add_parser(commands: Any) -> None:
    parser = add_command(commands, "serve", run, summary="serve a study with people", description=DESCRIPTION)
    parser.add_argument("study", metavar="STUDY.toml", help="study file, or `paper`")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder of the study")
    add_database(parser)
    parser.add_argument(
        "--film", type=Path, metavar="FILE.mp4", help="film of the house (default: made once)"
    )
    parser.add_argument("--rehearsal", type=float, metavar="FACTOR", help=argparse.SUPPRESS)  # of `rehearse`
    server = parser.add_argument_group("server")
    add_server_options(server)
    server.add_argument(
        "--workers",
        type=number(1, 10_000),
        metavar="N",
        help="trials at a time, each in a process; others wait (default: as many as the machine holds)",
    )
    server.add_argument(
        "--host-name", metavar="NAME", help="of this host, where several share a database (docs/deploy.md)"
    )
    group = parser.add_argument_group("researcher's page, health and metrics")
    group.add_argument("--researcher-port", type=number(0, 65535), metavar="PORT", help="serve them here")
    group.add_argument(
        "--researcher-host", default="127.0.0.1", metavar="ADDRESS", help="address to listen at"
    )
    group.add_argument("--researcher-url", metavar="URL", help="URL under which a proxy makes them public")


def run(arguments: argparse.Namespace) -> int:
    study = people_study(arguments)
    from experiments.study.data.copies import INDEX
    from experiments.study.plan import plan_of
    from experiments.visit.phases import phases_of

    if arguments.rehearsal is not None:
        from experiments.study.rehearsal.plan import rehearsed

        study = rehearsed(study, arguments.rehearsal)
    phases_of(plan_of(study))  # custom phases or codes of the platform may be missing
    check_public_url(arguments.public_url)
    check_public_url(arguments.researcher_url)
    prepare_process()  # the folder is nobody else's either
    arguments.out.mkdir(parents=True, exist_ok=True)
    with ExitStack() as open_things:
        listener = open_things.enter_context(listen(arguments.host, arguments.port))
        researchers = None
        if arguments.researcher_port is not None:
            at = listen(arguments.researcher_host, arguments.researcher_port)
            researchers = open_things.enter_context(at)
        open_things.enter_context(locked(arguments.out))
        (arguments.out / INDEX).touch()
        from experiments.web.server.pool import WorkerPool

        pool = WorkerPool(study.cells[0].trial(0).house)
        pool.warm_up()  # in parallel to the film
        film = _film(study, arguments)
        asyncio.run(_serve(study, pool, film, (listener, researchers), arguments))
    return 0


async def _serve(
    study: "Study",
    pool: "WorkerPool",
    film: Path | None,
    listeners: tuple[socket.socket, socket.socket | None],
    arguments: argparse.Namespace,
) -> None:
    import numpy as np

    from experiments.study.data.collect import check_people
    from experiments.study.data.retention import forget_daily
    from experiments.study.plan import plan_of
    from experiments.study.researcher.app import ResearcherContext, ResearcherServer
    from experiments.study.researcher.metrics import ServerMetrics, Timed
    from experiments.visit.folders import VISITS, VisitFolders
    from experiments.visit.procedure import Procedure
    from experiments.visit.server.app import ServerOptions, VisitServer
    from experiments.visit.store import Store

    url = arguments.database or sqlite_url(arguments.out / DATABASE)
    store = await Store.open(url, study.settings.name, study.sha256)
    check_people(study, await store.people())
    folders = VisitFolders(arguments.out.absolute() / VISITS)
    procedure = Procedure(plan_of(study, film), store, folders, np.random.default_rng())
    metrics = ServerMetrics()
    store.on_write(metrics.wrote)
    days = study.settings.limits.keep_days
    options = ServerOptions(
        _secret(arguments.out),
        arguments.trusted_proxy,
        metrics,
        arguments.host_name,
        arguments.workers,
        [functools.partial(forget_daily, store, folders.path, days)] if days else [],
    )
    server = VisitServer(procedure, pool, options)
    app = Timed(server.app(arguments.host, arguments.public_url), metrics)
    beside, (listener, researchers) = [], listeners
    if researchers is not None:
        watched = ResearcherContext(study, store, server.sessions, metrics)
        page = ResearcherServer(watched, arguments.researcher_url, arguments.trusted_proxy)
        beside.append((page.app(arguments.researcher_host), researchers))
    await serve(app, listener, arguments, beside)


def _secret(folder: Path) -> bytes:
    """The study's secret: of the environment, or a file that is made once."""
    if text := os.environ.get(SECRET):
        return text.encode()
    path = folder / SECRET_FILE
    if not path.is_file():
        from mjsim.support.files import write_text_atomically

        write_text_atomically(path, secrets.token_hex(32) + "\n")
        path.chmod(0o600)
    return path.read_bytes().strip()


def _film(study: "Study", arguments: argparse.Namespace) -> Path | None:
    """The film that the study shows, made now if there is none."""
    if FLYTHROUGH not in study.settings.phases:
        return None
    if arguments.film is not None:
        if not arguments.film.is_file():
            raise ConfigError(f"there is no film {arguments.film}; leave out --film, or name an MP4 file")
        return Path(arguments.film)
    path: Path = arguments.out / FILM
    if not path.is_file():
        from experiments.cli.flythrough import film_house

        film_house(study.cells[0].trial(0).house, path, language=study.settings.language)
    return path
