"""`mjsim study serve` and `mjsim study hosts`: serve a study on one or more hosts."""

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
    address,
    check_public_url,
    listen,
    locked,
    number,
    prepare_process,
    serve,
)
from experiments.cli.study.database import (
    add_database,
    add_served_study,
    add_study_file,
    checked_study,
    open_store,
    people_study,
    with_store,
)
from experiments.record.phases import FLYTHROUGH

if TYPE_CHECKING:
    from experiments.study.file import Study
    from experiments.visit.store import Store
    from experiments.web.server.pool import WorkerPool

SECRET_FILE, FILM = "secret", "flythrough.mp4"
SECRET = "MJSIM_STUDY_SECRET"
DESCRIPTION = f"""\
Serve a study with its phases: consent, a check of the computer, the story, a film of the house, questions about the
task, training, task, survey, and the return to the recruitment platform. STUDY.toml is a design with a table [study]
(docs/study.md). Print the URL on a separate line and open it.

All data are stored in --out: the database, run directories and journals of trials, the film, and the secret by which
participants of a platform are recognized ({SECRET} sets another secret). Ctrl-C stops the server.
Repeat the command to continue the study. Participants continue where they stopped."""


HOSTS = """\
List the hosts that serve a study (`mjsim study serve --host-name`), stop new visits on one of them, or hand over the
visits of a host that is gone. Before a handover, copy the folders DIR/visits/* of that host to the same place on
another host. Each visit then continues on the host that has its journal."""


def add_parser(commands: Any) -> None:
    parser = add_command(commands, "serve", run, DESCRIPTION, "serve a study")
    add_study_file(parser)
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder for the study")
    add_database(parser)
    parser.add_argument(
        "--film", type=Path, metavar="FILE.mp4", help="film of the house (default: one is made)"
    )
    # `mjsim study rehearse` starts the server with this option, which `--help` does not list.
    parser.add_argument("--rehearsal", type=float, metavar="FACTOR", help=argparse.SUPPRESS)
    server = parser.add_argument_group("server")
    add_server_options(server)
    server.add_argument(
        "--workers",
        type=number(1, 10_000),
        metavar="N",
        help="number of trials at a time, each in a process; others wait (default: as many as the machine can run)",
    )
    server.add_argument(
        "--host-name", metavar="NAME", help="name of this host, if several share a database (docs/deploy.md)"
    )
    group = parser.add_argument_group("researcher's page, health and metrics")
    group.add_argument(
        "--researcher-port",
        type=number(0, 65535),
        metavar="PORT",
        help="port of these pages (default: none)",
    )
    group.add_argument(
        "--researcher-host", type=address, default="127.0.0.1", metavar="ADDRESS", help="address to listen at"
    )
    group.add_argument("--researcher-url", metavar="URL", help="public URL of these pages behind a proxy")
    _add_hosts(commands)


def _add_hosts(commands: Any) -> None:
    parser = add_command(commands, "hosts", run_hosts, HOSTS, "manage the hosts that serve a study")
    add_served_study(parser)
    group = parser.add_mutually_exclusive_group()
    group.add_argument("--drain", metavar="NAME", help="stop new visits on a host")
    group.add_argument("--open", metavar="NAME", help="allow new visits on a drained host")
    group.add_argument("--hand-over", metavar="NAME", help="release the visits of a host that is gone")
    parser.add_argument(
        "--who", default="mjsim", metavar="NAME", help="name of the person who does this, for the audit log"
    )
    add_database(parser)


def run(arguments: argparse.Namespace) -> int:
    study = checked_study(arguments, recruits=True)
    from experiments.session.video import check_film

    if arguments.rehearsal is not None:
        from experiments.study.rehearsal.plan import rehearsed

        study = rehearsed(study, arguments.rehearsal)
    check_film(arguments.film)
    check_public_url(arguments.public_url)
    check_public_url(arguments.researcher_url)
    prepare_process()  # must come first so that the folder is created with private permissions
    arguments.out.mkdir(parents=True, exist_ok=True)
    with ExitStack() as stack:
        listener = stack.enter_context(listen(arguments.host, arguments.port))
        researchers = None
        if arguments.researcher_port is not None:
            at = listen(arguments.researcher_host, arguments.researcher_port)
            researchers = stack.enter_context(at)
        stack.enter_context(locked(arguments.out))
        from experiments.web.server.pool import WorkerPool

        pool = WorkerPool(study.cells[0].trial(0).house)
        pool.warm_up()  # the fork server starts while the video is recorded
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
    from experiments.study.data.copies import INDEX
    from experiments.study.data.retention import forget_daily
    from experiments.study.plan import plan_of
    from experiments.study.researcher.app import ResearcherContext, ResearcherServer
    from experiments.study.researcher.metrics import ServerMetrics, Timed
    from experiments.visit.folders import VISITS, VisitFolders
    from experiments.visit.procedure import Procedure
    from experiments.visit.server.app import ServerOptions, VisitServer

    store = await open_store(study, arguments, arguments.out, create=True)
    check_people(study, await store.people())
    (arguments.out / INDEX).touch()
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
    others, (listener, researchers) = [], listeners
    if researchers is not None:
        watched = ResearcherContext(study, store, server.sessions, metrics)
        page = ResearcherServer(watched, arguments.researcher_url, arguments.trusted_proxy)
        others.append((page.app(arguments.researcher_host), researchers))
    await serve(app, listener, arguments, others)


def run_hosts(arguments: argparse.Namespace) -> int:
    with_store(people_study(arguments), arguments, lambda store: _change_hosts(store, arguments))
    return 0


async def _change_hosts(store: "Store", arguments: argparse.Namespace) -> None:
    if name := arguments.drain or arguments.open:
        await store.drain(name, arguments.drain is not None, arguments.who)
    if name := arguments.hand_over:
        visits = await store.hand_over(name, arguments.who)
        print(f"{visits} visits of {name} continue where their journals are")
    for host in await store.hosts():
        print(f"{host.name}  last heartbeat {host.seen:%F %T} UTC{'  takes no new visits' * host.draining}")


def _secret(folder: Path) -> bytes:
    if text := os.environ.get(SECRET):
        return text.encode()
    path = folder / SECRET_FILE
    if not path.is_file():
        from mjsim.support.files import write_text_atomically

        write_text_atomically(path, secrets.token_hex(32) + "\n")
        path.chmod(0o600)
    return path.read_bytes().strip()


def _film(study: "Study", arguments: argparse.Namespace) -> Path | None:
    if FLYTHROUGH not in study.settings.phases:
        return None
    if arguments.film is not None:
        return Path(arguments.film)
    path: Path = arguments.out / FILM
    if not path.is_file():
        from experiments.cli.flythrough import film_house

        film_house(study.cells[0].trial(0).house, path, language=study.settings.language)
    return path
