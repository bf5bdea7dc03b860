"""`mjsim play`: a person at the keyboard, in a browser."""

import argparse
import fcntl
import logging
import os
import resource
import socket
import threading
import webbrowser
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from ipaddress import IPv4Network, IPv6Network, ip_network
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import msgspec

from experiments.cli.options import (
    add_command,
    add_setting,
    add_task_options,
    add_trial_options,
    given_options,
    seconds,
    trial_options,
)
from experiments.errors import ConfigError, RecordError
from experiments.procedure.comprehension import Question, read_questions
from experiments.procedure.story import story_text
from experiments.record.origin import HUMAN
from experiments.record.phases import FLYTHROUGH, PHASES, STORY, TASK, TRAINING, phases_of
from experiments.trials.trial_config import TrialConfig
from hud.conditions import condition
from planner.solver import SOLVERS, solver

OBJECTS = 6
PORT = 8000
MAX_FILES = 16384  # open files, sockets included
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
    """Add the subcommand."""
    parser = add_command(commands, "play", run, description=DESCRIPTION)
    add_task_options(parser, OBJECTS)
    parser.add_argument("--user", default=HUMAN, metavar="NAME", help="name of the participant")
    add_trial_options(parser, phases=",".join(PHASES))
    add_setting(parser, "draw")
    parser.add_argument(
        "--xr", action="store_true", help="offer a button for a headset, where there is one (experimental)"
    )
    group = parser.add_argument_group("server")
    group.add_argument(
        "--port", type=_number(0, 65535), default=PORT, help="TCP port; 0 for any that is free"
    )
    group.add_argument("--host", default="127.0.0.1", metavar="ADDRESS", help="address to listen at")
    group.add_argument(
        "--public-url", metavar="URL", help="URL under which a proxy makes the server public (docs/play.md)"
    )
    group.add_argument(
        "--trusted-proxy",
        type=_networks,
        default=(),
        metavar="ADDRESS,..",
        help="addresses or networks of proxies whose X-Forwarded-For tells who asks (docs/play.md)",
    )
    group.add_argument("--no-open", action="store_true", help="open no browser")
    group.add_argument(
        "--out", type=Path, default=Path("runs/play"), metavar="DIR", help="folder of visits and their runs"
    )
    group.add_argument(
        "--sessions",
        type=_number(1, 1000),
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
    """Serve until a signal comes."""
    trials = _trials(arguments)
    if arguments.film is not None and not arguments.film.is_file():
        raise ConfigError(f"there is no film {arguments.film}; leave out --film, or name an MP4 file")
    _check_public(arguments.public_url)
    questions = _questions(arguments)
    with _listen(arguments.host, arguments.port) as listener, _locked(arguments.out):
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
            **given_options(arguments, ("objects", "draw")),
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

    os.umask(0o077)  # what people did is nobody else's business
    _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(most, MAX_FILES) if most > 0 else MAX_FILES, most))

    pool = WorkerPool(trials[TASK]["house"])
    pool.warm_up()  # in parallel to the imports that follow

    import uvicorn

    from experiments.web.protocol import MAX_TEXT
    from experiments.web.server.app import PlayConfig, PlayServer
    from experiments.web.server.connections import QuickConnection

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
    logging.basicConfig(format="%(asctime)s %(message)s", datefmt="%H:%M:%S")
    logging.getLogger("mjsim.play").setLevel(logging.INFO)
    server = uvicorn.Server(
        uvicorn.Config(
            PlayServer(config, pool).app(arguments.host, arguments.public_url),
            log_config=None,
            access_log=False,  # paths hold tokens
            log_level="warning",
            server_header=False,
            proxy_headers=False,  # the guards believe those that are named
            http=QuickConnection,
            ws="websockets-sansio",
            ws_max_size=MAX_TEXT,
            ws_ping_interval=5.0,
            ws_ping_timeout=10.0,
            ws_per_message_deflate=True,
            timeout_graceful_shutdown=3,
            limit_concurrency=4000,
        )
    )
    url = arguments.public_url or _url(*listener.getsockname()[:2])
    print(url, flush=True)
    if not arguments.no_open:
        threading.Thread(target=webbrowser.open, args=(url,), daemon=True).start()
    server.run(sockets=[listener])


def _listen(host: str, port: int) -> socket.socket:
    """A socket that listens."""
    try:
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        return socket.create_server((host, port), family=family, backlog=100)
    except OSError as error:
        place = f"cannot listen at {host}, port {port}"
        raise OSError(
            error.errno, f"{place}: {error.strerror}; name another --port (0 for any) or --host"
        ) from error


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Keep other servers away from the folder of visits."""
    folder.mkdir(parents=True, exist_ok=True)
    handle = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        yield
    except BlockingIOError as error:
        raise RecordError(f"{folder} is in use by another `mjsim play`; choose another --out") from error
    finally:
        os.close(handle)


def _check_public(url: str | None) -> None:
    if url is None:
        return
    parts = urlsplit(url)
    if parts.scheme not in ("http", "https") or not parts.netloc or parts.path not in ("", "/"):
        raise ConfigError(f"public URL {url!r} must be of the form https://play.example.org")


def _url(host: str, port: int) -> str:
    shown = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host)
    return f"http://[{shown}]:{port}/" if ":" in shown else f"http://{shown}:{port}/"


def _networks(text: str) -> tuple[IPv4Network | IPv6Network, ...]:
    """Addresses and networks, joined by commas."""
    try:
        return tuple(ip_network(part.strip()) for part in text.split(","))
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def _minimum(text: str) -> dict[str, float]:
    """Seconds by phase before the task."""
    parts = dict(part.strip().partition("=")[::2] for part in text.split(","))
    if unknown := [name for name in parts if name not in PHASES or name == TASK]:
        raise argparse.ArgumentTypeError(f"no phase {unknown[0]!r} before the task in {text!r}")
    return {name: seconds(value) for name, value in parts.items()}


def _number(smallest: int, largest: int) -> Callable[[str], int]:
    """Parser of a whole number in a range."""

    def parse(text: str) -> int:
        if not text.isdecimal() or not smallest <= int(text) <= largest:
            raise argparse.ArgumentTypeError(f"{text!r} is not a number from {smallest} to {largest}")
        return int(text)

    return parse
