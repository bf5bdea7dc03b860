"""`mjsim play`: a person at the keyboard, in a browser."""

import argparse
import asyncio
import socket
from collections.abc import Sequence
from pathlib import Path
from typing import Any

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
from experiments.errors import ConfigError
from experiments.procedure.comprehension import Question, read_questions
from experiments.procedure.story import story_text
from experiments.record.origin import HUMAN
from experiments.record.phases import FLYTHROUGH, PHASES, STORY, TASK, TRAINING, phases_of
from experiments.trials.trial_config import TrialConfig
from hud.conditions import condition
from planner.solver import SOLVERS, solver

OBJECTS = 6
TRAINING_LIMIT = 24 * 3600.0  # s; as good as none

DESCRIPTION = """\
Start a server on which people tidy the apartment in a browser: by keyboard and mouse, gamepad or touch. Prints its URL
on a separate line and opens it. A visit is a story, a film of the house (if --film names one), a training with one
object, the task, and a page with the result; --phases leaves some out.

Every input is kept in --out at once: after a reload, a lost connection, or a crash of browser or server, the same link
resumes in the same state. A finished trial leaves a run directory as `mjsim run` does, DIR/<visit>/task and
DIR/<visit>/training, which `mjsim replay` verifies and films.

The server is reached from this machine alone unless --host is given; docs/play.md explains how to host it for others.
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
    group.add_argument("--film", type=Path, metavar="FILE.mp4", help="film of the house to show first")
    group.add_argument(
        "--minimum",
        type=_minimum,
        default={},
        metavar="PHASE=S,..",
        help="seconds before which story, flythrough and training cannot be ended (docs/play.md)",
    )
    group.add_argument(
        "--questions",
        type=Path,
        metavar="FILE",
        help="TOML file of questions about the story, to be answered before the visit begins (docs/play.md)",
    )


def run(arguments: argparse.Namespace) -> int:
    trials = _trials(arguments)
    if arguments.film is not None and not arguments.film.is_file():
        raise ConfigError(f"there is no film {arguments.film}; leave out --film, or name an MP4 file")
    check_public_url(arguments.public_url)
    questions = _questions(arguments)
    with listen(arguments.host, arguments.port) as listener, locked(arguments.out):
        _serve(arguments, trials, questions, listener)
    return 0


def _trials(arguments: argparse.Namespace) -> dict[str, dict[str, Any]]:
    """Settings of the training and the task."""
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
            "phases": ",".join(_phases(arguments)),
        },
    )
    from experiments.trials.training import training_config

    condition(task.assistance)
    condition(task.training_assistance)
    if task.planner not in SOLVERS:  # those are loaded by the workers
        solver(task.planner)
    training = msgspec.structs.replace(training_config(task), time_limit=TRAINING_LIMIT)
    return {TRAINING: training.settings(), TASK: task.settings()}


def _phases(arguments: argparse.Namespace) -> tuple[str, ...]:
    """The phases of a visit; a fly-through needs a film.

    Raises:
        ConfigError: There is no such phase.
    """
    return tuple(
        name for name in phases_of(arguments.phases) if name != FLYTHROUGH or arguments.film is not None
    )


def _questions(arguments: argparse.Namespace) -> Sequence[Question]:
    """The questions about the story, after a check that the phases which options name are shown."""
    named = {**arguments.minimum, **({STORY: 0.0} if arguments.questions else {})}
    if missing := [name for name in named if name not in _phases(arguments)]:
        raise ConfigError(f"--minimum or --questions is about the phase {missing[0]}, which is not shown")
    return read_questions(arguments.questions) if arguments.questions else ()


def _serve(
    arguments: argparse.Namespace,
    trials: dict[str, dict[str, Any]],
    questions: Sequence[Question],
    listener: socket.socket,
) -> None:
    from experiments.web.server.pool import WorkerPool  # imported here, so that other commands start fast

    prepare_process()
    pool = WorkerPool(trials[TASK]["house"])
    pool.warm_up()  # in parallel to the imports that follow

    from experiments.web.server.app import PlayConfig, PlayServer

    phases = _phases(arguments)
    config = PlayConfig(
        phases=phases,
        trials=trials,
        folder=arguments.out.absolute(),
        sessions=arguments.sessions,
        idle=max(arguments.idle, 1.0),
        film=arguments.film,
        story=story_text(None if arguments.story is None else Path(arguments.story))
        if STORY in phases
        else "",
        minimum=arguments.minimum,
        questions=questions,
        proxies=arguments.trusted_proxy,
        xr=arguments.xr,
    )
    app = PlayServer(config, pool).app(arguments.host, arguments.public_url)
    asyncio.run(serve(app, listener, arguments))


def _minimum(text: str) -> dict[str, float]:
    parts = dict(part.strip().partition("=")[::2] for part in text.split(","))
    if unknown := [name for name in parts if name not in PHASES or name == TASK]:
        raise argparse.ArgumentTypeError(f"no phase {unknown[0]!r} before the task in {text!r}")
    return {name: seconds(value) for name, value in parts.items()}
