"""Option types and options that several subcommands share."""

import argparse
import math
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from experiments.commands.person_options import add_person_options, person_options
from experiments.errors import ConfigError
from experiments.participants import DEFAULT_PARTICIPANT, participant_names
from experiments.runs.phases import PHASES
from experiments.session.film_config import FilmConfig
from experiments.trials.design import numbers
from experiments.trials.trial_config import SEEDS, TrialConfig, episode_settings
from hud.conditions import condition_names
from hud.options import option_names
from mjsim.episode import CAPACITY, POINTS
from mjsim.options import CAPACITIES, FIDELITIES
from mjsim.render import FAST, PROFILES
from mjsim.render.profiles import MAX_SIDE
from planner.solver import DEFAULT_SOLVER, SOLVERS

HOUSE_HELP = "name of a house, or path of its catalogue.toml"


def int_list(text: str) -> list[int]:
    """Parse `6,12` or `0:10` (the end not included) or a mix of both.

    Raises:
        argparse.ArgumentTypeError: It is neither, or too long.
    """
    try:
        return numbers(text)
    except ConfigError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def text_list(text: str) -> list[str]:
    """Parse `none,highlight`."""
    return [part.strip() for part in text.split(",") if part.strip()]


def frame_size(text: str) -> tuple[int, int]:
    """Parse `640x480`.

    Raises:
        argparse.ArgumentTypeError: It is not of that form, or odd: H.264 needs even sizes.
    """
    match = re.fullmatch(r"(\d+)x(\d+)", text)
    if not match:
        raise argparse.ArgumentTypeError(f"{text!r} is not of the form WIDTHxHEIGHT, such as 640x480")
    width, height = int(match[1]), int(match[2])
    if width % 2 or height % 2 or width < 160 or height < 120 or max(width, height) > MAX_SIDE:
        raise argparse.ArgumentTypeError(
            f"{text} must be even in both directions, at least 160x120 and at most {MAX_SIDE}x{MAX_SIDE}"
        )
    return width, height


def seconds(text: str) -> float:
    """Parse a time, s.

    Raises:
        argparse.ArgumentTypeError: It is not a finite number from 0 on.
    """
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0 <= value < math.inf:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of seconds from 0 on")
    return value


class HelpFormatter(argparse.RawDescriptionHelpFormatter, argparse.ArgumentDefaultsHelpFormatter):
    """Keeps line breaks of descriptions, and names the default of every option that has one."""

    def _get_help_string(self, action: argparse.Action) -> str | None:
        has_default = action.option_strings and action.default is not None and action.nargs != 0
        return super()._get_help_string(action) if has_default else action.help


def add_command(
    commands: Any, name: str, run: Callable[[argparse.Namespace], int], *, summary: str, description: str
) -> argparse.ArgumentParser:
    """Add a subcommand.

    Args:
        commands: Where subcommands are added.
        name: Name of the subcommand.
        run: Carries it out; returns the exit code.
        summary: One line for the list of commands.
        description: The beginning of its own help.
    """
    parser: argparse.ArgumentParser = commands.add_parser(
        name, help=summary, description=description, formatter_class=HelpFormatter
    )
    parser.set_defaults(run=run)
    return parser


def add_force(parser: argparse.ArgumentParser, text: str = "replace files that exist") -> None:
    """Add `--force`."""
    parser.add_argument("--force", action="store_true", help=text)


def add_house(parser: argparse.ArgumentParser) -> None:
    """Add `--house`."""
    parser.add_argument("--house", default="apartment", metavar="NAME", help=HOUSE_HELP)


def add_points(parser: argparse.ArgumentParser) -> None:
    """Add `--points`."""
    parser.add_argument(
        "--points",
        type=int,
        metavar="N",
        help="points of the house where objects may lie, at least 1 m apart; fewer fit into a small house "
        f"(default: {POINTS})",
    )


def add_trial_options(parser: argparse.ArgumentParser, *, several_users: bool = False) -> None:
    """Add the options that a run and a batch have in common; those not given are None."""
    parser.add_argument(
        "--user",
        metavar="NAME,.." if several_users else "NAME",
        type=text_list if several_users else str,
        help=f"simulated participant: {', '.join(participant_names())}, or package.module:attribute; "
        "follower uses whatever guidance is shown, in any condition; "
        "boltzmann:T chooses a visit that costs r metres more with odds exp(-r/T) "
        f"(default: {DEFAULT_PARTICIPANT})",
    )
    add_trial_settings(parser)


def add_trial_settings(parser: argparse.ArgumentParser) -> None:
    """Add what a run, a batch and play have in common; options that are not given are None."""
    parser.add_argument("--house", metavar="NAME", help=f"{HOUSE_HELP} (default: {TrialConfig.house})")
    parser.add_argument(
        "--planner",
        metavar="NAME",
        help=f"route planner: {', '.join(SOLVERS)}, or package.module:attribute (default: {DEFAULT_SOLVER})",
    )
    parser.add_argument(
        "--fidelity",
        choices=FIDELITIES,
        help="full: everything is physics; windows: picks and places are physics, walking is kinematic; "
        f"event: only what falls is physics (docs/fidelity.md; default: {TrialConfig.fidelity})",
    )
    parser.add_argument(
        "--no-regret",
        dest="regret",
        action="store_const",
        const=False,
        help="do not compute what each visit cost compared with the best one (takes up to 1 s a trial)",
    )
    parser.add_argument(
        "--time-limit",
        type=seconds,
        metavar="S",
        help="simulated seconds after which a trial ends (default: 60, plus 150 per object)",
    )
    add_points(parser)
    _add_task_settings(parser)
    for name, what in SEEDS.items():
        option = f"--{name.replace('_', '-')}"
        parser.add_argument(option, type=int, metavar="S", help=f"seed of {what} (default: the seed)")
    add_person_options(parser)


def _add_task_settings(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--capacity",
        type=int,
        choices=CAPACITIES,
        help=f"objects carried at most; with 1, in the right hand (default: {CAPACITY})",
    )
    parser.add_argument(
        "--episode",
        type=Path,
        metavar="FILE",
        help="run this episode (an episode.json) instead of sampling one; its objects, house and seed hold",
    )
    parser.add_argument(
        "--phases",
        metavar="NAME,..",
        help=f"what the participant goes through: any of {', '.join(PHASES)} in this order, the task last "
        f"(docs/procedure.md; default: {TrialConfig.phases})",
    )
    parser.add_argument(
        "--story", type=Path, metavar="FILE", help="text to read in the phase story, instead of the usual one"
    )


TRIAL_OPTIONS = (
    "house",
    "planner",
    "fidelity",
    "regret",
    "time_limit",
    "points",
    "capacity",
    "phases",
    "story",
    *SEEDS,
)


def given_options(arguments: argparse.Namespace, names: Sequence[str]) -> dict[str, Any]:
    """The options of these names that are given."""
    return {name: value for name in names if (value := getattr(arguments, name)) is not None}


def trial_options(arguments: argparse.Namespace) -> dict[str, Any]:
    """The options of `add_trial_options` that are given, but for the user, as arguments of `TrialConfig`.

    Raises:
        ConfigError: An episode is given together with what it decides, or no such person is possible.
        EpisodeError: The episode cannot be read.
    """
    options = {**given_options(arguments, TRIAL_OPTIONS), **person_options(arguments)}
    if arguments.episode is None:
        return options
    if arguments.objects is not None or arguments.house_seed is not None or arguments.points is not None:
        raise ConfigError(
            "--episode says which objects lie where; leave out --objects, --points and --house-seed"
        )
    return {**episode_settings(arguments.episode), **options}


def add_frame(
    parser: argparse.ArgumentParser, *, size: tuple[int, int] = (640, 480), profile: str = FAST.name
) -> None:
    """Add `--size` and `--profile` with these defaults."""
    parser.add_argument(
        "--size", type=frame_size, default=f"{size[0]}x{size[1]}", metavar="WxH", help="frame size, px"
    )
    parser.add_argument(
        "--profile", default=profile, metavar="NAME", help=f"render profile: {', '.join(PROFILES)}"
    )


def film_config(arguments: argparse.Namespace) -> FilmConfig:
    """The options of `add_frame`."""
    width, height = arguments.size
    return FilmConfig(width, height, arguments.profile)


def assistance_help() -> str:
    """The values of `--assistance`."""
    options = ", ".join(f"-{name}" for name in option_names())
    names = ", ".join(condition_names())
    return f"assistance condition: {names}, or package.module:attribute; {options} may follow"
