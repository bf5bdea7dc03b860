"""`mjsim play`: a person at the keyboard, in a browser."""

import argparse
import dataclasses
import fcntl
import logging
import os
import socket
import threading
import webbrowser
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from experiments.commands.options import (
    add_command,
    add_trial_settings,
    assistance_help,
    given_options,
    seconds,
    trial_options,
)
from experiments.errors import ConfigError, RecordError
from experiments.familiarisation.story import story_text
from experiments.origin import HUMAN
from experiments.runs.phases import FLYTHROUGH, PHASES, STORY, TASK, TRAINING, phases_of
from experiments.trials.training import training_config
from experiments.trials.trial_config import TrialConfig
from hud.conditions import condition
from planner.solver import SOLVERS, solver

OBJECTS = 6
PORT = 8000
TRAINING_LIMIT = 24 * 3600.0  # s; as good as none

DESCRIPTION = """\
Start a server on which people tidy the apartment in a browser: by keyboard and mouse, gamepad or touch. Prints its URL
on a line of its own and opens it. A visit is a story, a film of the house (where --film names one), a training with one
object, the task, and a page with the result; --phases leaves some out.

Everything that is pressed is kept in --out at once: after a reload, a lost connection, or a crash of browser or server,
the same link goes on in the same state. A trial that is over leaves a run directory as `mjsim run` does, which `mjsim
replay` verifies and films: DIR/<visit>/task and DIR/<visit>/training.

The server is reached from this machine alone unless --host says otherwise; docs/play.md tells how to host it for
others. Ctrl-C ends it; the same command goes on."""


def add_parser(commands: Any) -> None:
    """Add the subcommand."""
    parser = add_command(
        commands, "play", run, summary="tidy the apartment yourself, in a browser", description=DESCRIPTION
    )
    parser.add_argument(
        "--objects", type=int, metavar="N", help="misplaced objects, 1 to --points (default: 6)"
    )
    parser.add_argument("--assistance", default="optimal", metavar="NAME", help=assistance_help())
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="seed of the house and the list")
    parser.add_argument("--user", default=HUMAN, metavar="NAME", help="name of the participant")
    add_trial_settings(parser)
    group = parser.add_argument_group("server")
    group.add_argument("--port", type=_port, default=PORT, help="TCP port; 0 for any that is free")
    group.add_argument("--host", default="127.0.0.1", metavar="ADDRESS", help="address to listen at")
    group.add_argument(
        "--public-url", metavar="URL", help="URL under which a proxy makes the server public (docs/play.md)"
    )
    group.add_argument("--no-open", action="store_true", help="open no browser")
    group.add_argument(
        "--out", type=Path, default=Path("runs/play"), metavar="DIR", help="folder of visits and their runs"
    )
    group.add_argument(
        "--sessions", type=_count, default=1, metavar="N", help="how many people play at a time; others wait"
    )
    group.add_argument(
        "--idle",
        type=seconds,
        default=1800.0,
        metavar="S",
        help="seconds without a sign of a person after which the place is given to somebody else",
    )
    group.add_argument("--film", type=Path, metavar="FILE.mp4", help="film of the house to show first")


def run(arguments: argparse.Namespace) -> int:
    """Serve until a signal comes."""
    trials = _trials(arguments)
    if arguments.film is not None and not arguments.film.is_file():
        raise ConfigError(f"there is no film {arguments.film}; leave out --film, or name an MP4 file")
    _check_public(arguments.public_url)
    with _listening(arguments.host, arguments.port) as listener, _locked(arguments.out):
        _serve(arguments, trials, listener)
    return 0


def _trials(arguments: argparse.Namespace) -> dict[str, dict[str, Any]]:
    """Settings of the training and the task.

    Raises:
        ExperimentError, HudError, PlannerError: An option is unusable.
    """
    if arguments.user != HUMAN:
        raise ConfigError(f"`mjsim play` is for a person; user {arguments.user} belongs to `mjsim run`")
    task = TrialConfig(
        assistance=arguments.assistance,
        seed=arguments.seed,
        live=True,
        user=HUMAN,
        **{
            "objects": OBJECTS,
            **given_options(arguments, ("objects",)),
            **trial_options(arguments),
            "phases": ",".join(_phases(arguments)),
        },
    )
    condition(task.assistance)
    if task.planner not in SOLVERS:  # those are loaded by the workers
        solver(task.planner)
    training = dataclasses.replace(training_config(task), time_limit=TRAINING_LIMIT)
    return {TRAINING: training.settings(), TASK: task.settings()}


def _phases(arguments: argparse.Namespace) -> tuple[str, ...]:
    """The phases of a visit; a fly-through needs a film.

    Raises:
        ConfigError: There is no such phase.
    """
    names = phases_of(arguments.phases or ",".join(PHASES))
    return tuple(name for name in names if name != FLYTHROUGH or arguments.film is not None)


def _serve(arguments: argparse.Namespace, trials: dict[str, dict[str, Any]], listener: socket.socket) -> None:
    from experiments.web.pool import Pool  # imported late, so that other commands start fast

    pool = Pool(trials[TASK]["house"], arguments.out.absolute())
    pool.warm_up()  # beside the imports that follow
    try:
        _listen(arguments, _server(arguments, trials, pool), listener)
    finally:
        pool.hang_up()


def _server(arguments: argparse.Namespace, trials: dict[str, dict[str, Any]], pool: Any) -> Any:
    from experiments.web.server import PlayConfig, PlayServer

    phases = _phases(arguments)
    config = PlayConfig(
        phases=phases,
        trials=trials,
        folder=arguments.out.absolute(),
        sessions=arguments.sessions,
        idle=max(arguments.idle, 1.0),
        film=arguments.film,
        story=story_text(arguments.story) if STORY in phases else "",
    )
    return PlayServer(config, pool)


def _listen(arguments: argparse.Namespace, play: Any, listener: socket.socket) -> None:
    import uvicorn

    from experiments.web.guards import Addresses
    from experiments.web.protocol import MAX_TEXT

    _log_to_stderr()
    host, port = listener.getsockname()[:2]
    server = uvicorn.Server(
        uvicorn.Config(
            play.app(Addresses(port, arguments.public_url)),
            log_config=None,
            access_log=False,  # paths hold tokens
            log_level="warning",
            server_header=False,
            ws="websockets-sansio",
            ws_max_size=MAX_TEXT,
            ws_ping_interval=5.0,
            ws_ping_timeout=10.0,
            ws_per_message_deflate=False,
            timeout_graceful_shutdown=3,
            limit_concurrency=1000,
        )
    )
    url = arguments.public_url or _url(host, port)
    print(url, flush=True)
    if not arguments.no_open:
        threading.Thread(target=webbrowser.open, args=(url,), daemon=True).start()
    server.run(sockets=[listener])


@contextmanager
def _listening(host: str, port: int) -> Iterator[socket.socket]:
    """A socket that listens.

    Raises:
        OSError: The address cannot be had; the message names the remedy.
    """
    try:
        family, _, _, _, address = socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        listener = socket.socket(family)
    except OSError as error:
        raise OSError(
            error.errno, f"cannot listen at {host}: {error.strerror}; name another --host"
        ) from error
    with listener:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind(address)
            listener.listen(100)
        except OSError as error:
            raise OSError(
                error.errno,
                f"cannot listen at {host}, port {port}: {error.strerror}; name another --port (0 for any) or --host",
            ) from error
        yield listener


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Keep other servers away from the folder of visits.

    Raises:
        RecordError: One is there.
        OSError: The folder cannot be made.
    """
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


def _log_to_stderr() -> None:
    handler = logging.StreamHandler()
    handler.setFormatter(logging.Formatter("%(asctime)s %(message)s", "%H:%M:%S"))
    log = logging.getLogger("mjsim.play")
    log.addHandler(handler)
    log.setLevel(logging.INFO)
    log.propagate = False


def _port(text: str) -> int:
    """Parse a TCP port.

    Raises:
        argparse.ArgumentTypeError: It is none.
    """
    if not text.isdecimal() or int(text) > 65535:
        raise argparse.ArgumentTypeError(f"{text!r} is not a port from 0 to 65535")
    return int(text)


def _count(text: str) -> int:
    """Parse how many people play at a time.

    Raises:
        argparse.ArgumentTypeError: It is not 1 to 1000.
    """
    if not text.isdecimal() or not 1 <= int(text) <= 1000:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number from 1 to 1000")
    return int(text)
