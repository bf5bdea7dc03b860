"""`mjsim play`: a person at the keyboard, in a browser."""

import argparse
import asyncio
import socket
from pathlib import Path
from typing import TYPE_CHECKING, Any

from experiments.cli.options import (
    PAGE_SETTINGS,
    add_command,
    add_setting,
    add_task_options,
    add_trial_options,
    given_options,
    seconds,
    trial_options,
)
from experiments.cli.play_phases import questions_of, shown_phases
from experiments.cli.server import (
    add_server_options,
    check_public_url,
    listen,
    locked,
    number,
    prepare_process,
    serve,
)
from experiments.cli.study.database import DATABASE, sqlite_url
from experiments.errors import ConfigError
from experiments.record.phases import HUMAN, PHASES, TASK
from experiments.trials.trial_config import TrialConfig
from hud.conditions import condition
from planner.solvers import SOLVERS, solver

if TYPE_CHECKING:
    from experiments.web.server.pool import WorkerPool

OBJECTS = 6

DESCRIPTION = """\
Start a server on which people tidy the apartment in a browser: by keyboard and mouse, gamepad or touch. Prints its URL
on a separate line and opens it. A visit is a story, a film of the house (if --film names one), a training with one
object, the task, and a page with the result; --phases leaves some out.

Every input is kept in --out at once: after a reload, a lost connection, or a crash of browser or server, the same link
resumes in the same state. A finished trial leaves a run directory as `mjsim run` does, DIR/<visit>/task and
DIR/<visit>/training, which `mjsim replay` verifies and films.

The server is reached from this machine alone unless --host is given; docs/deploy.md explains how to host it for others.
Ctrl-C ends it; the same command resumes."""


def add_parser(commands: Any) -> None:
    parser = add_command(commands, "play", run, description=DESCRIPTION)
    add_task_options(parser, OBJECTS)
    parser.add_argument("--user", default=HUMAN, metavar="NAME", help="name of the participant")
    add_trial_options(parser, phases=",".join(PHASES))
    for name in PAGE_SETTINGS:
        add_setting(parser, name)
    parser.add_argument(
        "--xr", action="store_true", help="offer a button for a headset, where there is one (experimental)"
    )
    group = parser.add_argument_group("server")
    add_server_options(group)
    group.add_argument(
        "--out", type=Path, default=Path("runs/play"), metavar="DIR", help="folder of visits and their runs"
    )
    group.add_argument(
        "--sessions",
        type=number(1, 1000),
        default=1,
        metavar="N",
        help="how many people can play at a time; others wait",
    )
    group.add_argument(
        "--idle",
        type=seconds,
        default=1800.0,
        metavar="S",
        help="seconds without a sign of the person after which the place is given to another one",
    )
    group.add_argument(
        "--language", default="en", metavar="TAG", help="language of the pages: en or de (default: en)"
    )
    group.add_argument("--film", type=Path, metavar="FILE.mp4", help="film of the house to show first")
    group.add_argument(
        "--minimum",
        type=_minimum,
        default={},
        metavar="PHASE=S,..",
        help="seconds before which story, flythrough and training cannot be ended (docs/browser.md)",
    )
    group.add_argument(
        "--questions",
        type=Path,
        metavar="FILE",
        help="TOML file of questions about the story, which have to be answered correctly (docs/browser.md)",
    )


def run(arguments: argparse.Namespace) -> int:
    task = task_of(arguments)
    if arguments.film is not None and not arguments.film.is_file():
        raise ConfigError(f"there is no film {arguments.film}; leave out --film, or name an MP4 file")
    check_public_url(arguments.public_url)
    questions_of(arguments)  # before anything is started
    with listen(arguments.host, arguments.port) as listener, locked(arguments.out):
        _serve(arguments, task, listener)
    return 0


def task_of(arguments: argparse.Namespace) -> TrialConfig:
    if arguments.user != HUMAN:
        raise ConfigError(f"`mjsim play` is for a person; user {arguments.user} belongs to `mjsim run`")
    task = TrialConfig(
        assistance=arguments.assistance,
        seed=arguments.seed,
        live=True,
        user=HUMAN,
        **{
            "objects": OBJECTS,
            **given_options(arguments, ("objects", *PAGE_SETTINGS)),
            **trial_options(arguments),
            "phases": ",".join(shown_phases(arguments)),
        },
    )
    condition(task.assistance)
    condition(task.training_assistance)
    if task.planner not in SOLVERS:  # those are loaded by the workers
        solver(task.planner)
    return task


def _serve(arguments: argparse.Namespace, task: TrialConfig, listener: socket.socket) -> None:
    from experiments.web.server.pool import WorkerPool  # imported here, so that other commands start fast

    prepare_process()
    pool = WorkerPool(task.house)
    pool.warm_up()  # in parallel to the imports that follow
    asyncio.run(_serve_visits(arguments, task, pool, listener))


async def _serve_visits(
    arguments: argparse.Namespace, task: TrialConfig, pool: "WorkerPool", listener: socket.socket
) -> None:
    import numpy as np

    from experiments.cli.play_plan import NAME, plan_of_play
    from experiments.visit.folders import VisitFolders
    from experiments.visit.procedure import Procedure
    from experiments.visit.server.app import ServerOptions, VisitServer
    from experiments.visit.store import Store

    store = await Store.open(sqlite_url(arguments.out / DATABASE), NAME, "0" * 64)
    folders = VisitFolders(arguments.out.absolute())
    procedure = Procedure(plan_of_play(arguments, task), store, folders, np.random.default_rng())
    await procedure.adopt()
    options = ServerOptions(proxies=arguments.trusted_proxy, workers=arguments.sessions)
    app = VisitServer(procedure, pool, options).app(arguments.host, arguments.public_url)
    await serve(app, listener, arguments)


def _minimum(text: str) -> dict[str, float]:
    parts = dict(part.strip().partition("=")[::2] for part in text.split(","))
    if unknown := [name for name in parts if name not in PHASES or name == TASK]:
        raise argparse.ArgumentTypeError(f"no phase {unknown[0]!r} before the task in {text!r}")
    return {name: seconds(value) for name, value in parts.items()}
