"""`mjsim play`: let a person tidy an apartment in a browser."""

import argparse
import asyncio
import socket
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import msgspec

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
from experiments.record.phases import FLYTHROUGH, HUMAN, PHASES, STORY, TASK, phases_of
from experiments.trials.trial_config import TrialConfig
from experiments.visit.texts import languages
from experiments.visit.texts.items import Item
from hud.conditions import condition
from mjsim.house.catalogue.files import catalogue_file
from mjsim.house.catalogue.house_ref import parse_house
from mjsim.support.toml import read_toml
from planner.solvers import SOLVERS, solver

if TYPE_CHECKING:
    from experiments.web.server.pool import WorkerPool

OBJECTS = 6

MAX_MINIMUM_S = 86400  # longest minimum duration of a phase, in seconds
DESCRIPTION = """\
Start a server on which people tidy the apartment in a browser, with keyboard and mouse, gamepad or touch. Print its URL
on a separate line and open it. A visit consists of a story, a film of the house (with --film), a training with one
object, the task, and a results page. --phases leaves some out.

Every input is saved in --out immediately. After a reload, a lost connection, or a crash of browser or server, the same
link resumes in the same state. Finished trials leave run directories like those of `mjsim run`, DIR/VISIT/task and
DIR/VISIT/training, which `mjsim replay` verifies and films.

The server accepts only connections from this machine unless --host is given. docs/deploy.md explains how to host it for
others. Ctrl-C stops the server, and the same command resumes."""


def add_parser(commands: Any) -> None:
    parser = add_command(commands, "play", run, DESCRIPTION)
    add_task_options(parser, OBJECTS)
    parser.add_argument("--user", default=HUMAN, metavar="NAME", help="name of the participant")
    add_trial_options(parser, phases=",".join(PHASES))
    for name in PAGE_SETTINGS:
        add_setting(parser, name)
    parser.add_argument(
        "--xr", action="store_true", help="show a button for a connected headset (experimental)"
    )
    group = parser.add_argument_group("server")
    add_server_options(group)
    group.add_argument(
        "--out", type=Path, default=Path("runs/play"), metavar="DIR", help="folder for visits and their runs"
    )
    group.add_argument(
        "--sessions",
        type=number(1, 1000),
        default=1,
        metavar="N",
        help="number of people who can play at a time; others wait",
    )
    group.add_argument(
        "--idle",
        type=seconds,
        default=1800.0,
        metavar="S",
        help="seconds without a heartbeat after which a person's slot is given to another person",
    )
    group.add_argument(
        "--language",
        choices=languages(),
        default="en",
        metavar="TAG",
        help="language of the pages: en or de",
    )
    group.add_argument(
        "--film", type=Path, metavar="FILE.mp4", help="film of the house to show before the task"
    )
    group.add_argument(
        "--minimum",
        type=_minimum,
        default={},
        metavar="PHASE=S,..",
        help="minimum durations of story, flythrough and training, in seconds (docs/browser.md)",
    )
    group.add_argument(
        "--questions",
        type=Path,
        metavar="FILE",
        help="TOML file of questions about the story that must be answered correctly (docs/browser.md)",
    )


def run(arguments: argparse.Namespace) -> int:
    task = task_of(arguments)
    if arguments.film is not None:
        from experiments.session.video import check_film

        check_film(arguments.film)
    check_public_url(arguments.public_url)
    questions = questions_of(arguments)
    with listen(arguments.host, arguments.port) as listener, locked(arguments.out):
        _serve(arguments, task, questions, listener)
    return 0


def task_of(arguments: argparse.Namespace) -> TrialConfig:
    if arguments.user != HUMAN:
        raise ConfigError(f"`mjsim play` is for people; user {arguments.user} belongs to `mjsim run`")
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
    if (house := parse_house(task.house)).file is not None:  # houses are only loaded in the worker processes
        catalogue_file(house)
    if task.planner not in SOLVERS:  # built-in planners are only loaded in the worker processes
        solver(task.planner)
    return task


def _serve(
    arguments: argparse.Namespace, task: TrialConfig, questions: tuple[Item, ...], listener: socket.socket
) -> None:
    from experiments.web.server.pool import WorkerPool

    prepare_process()
    pool = WorkerPool(task.house)
    pool.warm_up()  # the fork server starts while the modules below are imported
    asyncio.run(_serve_visits(arguments, task, questions, pool, listener))


async def _serve_visits(
    arguments: argparse.Namespace,
    task: TrialConfig,
    questions: tuple[Item, ...],
    pool: "WorkerPool",
    listener: socket.socket,
) -> None:
    import numpy as np

    from experiments.cli.play_plan import NAME, plan_of_play
    from experiments.visit.folders import VisitFolders
    from experiments.visit.procedure import Procedure
    from experiments.visit.server.app import ServerOptions, VisitServer
    from experiments.visit.store import Store

    plan = plan_of_play(arguments, task, shown_phases(arguments), questions)
    store = await Store.open(sqlite_url(arguments.out / DATABASE), NAME, "0" * 64, alone=True)
    folders = VisitFolders(arguments.out.absolute())
    procedure = Procedure(plan, store, folders, np.random.default_rng())
    await procedure.adopt()
    options = ServerOptions(proxies=arguments.trusted_proxy, workers=arguments.sessions)
    app = VisitServer(procedure, pool, options).app(arguments.host, arguments.public_url)
    await serve(app, listener, arguments)


def _minimum(text: str) -> dict[str, float]:
    parts = dict(part.strip().partition("=")[::2] for part in text.split(","))
    if unknown := [name for name in parts if name not in PHASES or name == TASK]:
        raise argparse.ArgumentTypeError(f"no phase {unknown[0]!r} before the task in {text!r}")
    found = {name: seconds(value) for name, value in parts.items()}
    if (longest := max(found.values())) > MAX_MINIMUM_S:
        raise argparse.ArgumentTypeError(f"{longest:g} s is too long; give at most {MAX_MINIMUM_S} s")
    return found


def shown_phases(arguments: argparse.Namespace) -> tuple[str, ...]:
    """Return the names of the phases to show. The fly-through is left out if there is no video for it."""
    return tuple(
        name for name in phases_of(arguments.phases) if name != FLYTHROUGH or arguments.film is not None
    )


def questions_of(arguments: argparse.Namespace) -> tuple[Item, ...]:
    """Read questions from `[[question]]` tables with `text`, `choices` and `answer` in a TOML file."""
    path: Path | None = arguments.questions
    named = {**arguments.minimum, **({STORY: 0.0} if path else {})}
    if missing := [name for name in named if name not in shown_phases(arguments)]:
        raise ConfigError(f"--minimum or --questions refers to the phase {missing[0]}, which is not shown")
    if path is None:
        return ()
    try:
        asked = read_toml(path).get("question") or []
        items = [
            {"name": f"question_{number}", "kind": "choice", "text": one["text"]}
            | {"choices": one["choices"], "right": one["answer"]}
            for number, one in enumerate(asked, 1)
        ]
        found: tuple[Item, ...] = msgspec.convert(
            items, Annotated[tuple[Item, ...], msgspec.Meta(min_length=1)]
        )
        return found
    except OSError as error:
        raise ConfigError(f"cannot read the questions {path}: {error.strerror}") from error
    except (KeyError, TypeError, ValueError, msgspec.ValidationError) as error:
        raise ConfigError(f"{path} has no valid questions: {error}") from error
