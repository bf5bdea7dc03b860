"""Option types and options that several subcommands share."""

import argparse
import re
from collections.abc import Callable
from typing import Any

from experiments.first_person import FilmConfig
from experiments.participants import participant_names
from hud.conditions import condition_names
from hud.options import option_names
from mjsim.options import FIDELITIES, WorldOptions
from mjsim.render import FAST, PROFILES
from planner.solver import DEFAULT_SOLVER, SOLVERS


def int_list(text: str) -> list[int]:
    """Parse `6,12` or `0:10` (the end not included) or a mix of both.

    Raises:
        argparse.ArgumentTypeError: It is neither.
    """
    values: list[int] = []
    for part in text.split(","):
        if match := re.fullmatch(r"(\d+):(\d+)", part):
            values.extend(range(int(match[1]), int(match[2])))
        elif re.fullmatch(r"\d+", part):
            values.append(int(part))
        else:
            raise argparse.ArgumentTypeError(f"{part!r} is neither a number nor a range such as 0:10")
    if not values:
        raise argparse.ArgumentTypeError(f"{text!r} names no number; a range's end is not included")
    return values


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
    if width % 2 or height % 2 or width < 160 or height < 120:
        raise argparse.ArgumentTypeError(f"{text} must be even in both directions and at least 160x120")
    return width, height


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


def add_house(parser: argparse.ArgumentParser) -> None:
    """Add `--house`."""
    parser.add_argument(
        "--house", default="apartment", metavar="NAME", help="name of a house, or path of its catalogue.toml"
    )


def add_trial_options(parser: argparse.ArgumentParser) -> None:
    """Add the options that a run and a batch have in common."""
    parser.add_argument(
        "--user",
        metavar="NAME",
        help=f"simulated participant: {', '.join(participant_names())}, or package.module:attribute; "
        "boltzmann:T chooses a visit that costs r metres more with odds exp(-r/T) "
        "(default: the one that makes the most of the assistance)",
    )
    add_house(parser)
    parser.add_argument(
        "--planner", default=DEFAULT_SOLVER, metavar="NAME", help=f"route planner: {', '.join(SOLVERS)}"
    )
    parser.add_argument(
        "--fidelity",
        choices=FIDELITIES,
        default=WorldOptions.fidelity,
        help="full: everything is physics; windows: picks and places are physics, walking is kinematic; "
        "event: only what falls is physics (docs/fidelity.md)",
    )
    parser.add_argument(
        "--no-regret",
        dest="regret",
        action="store_false",
        help="do not compute what each visit cost compared with the best one (takes up to 1 s a trial)",
    )


def trial_options(arguments: argparse.Namespace) -> dict[str, Any]:
    """The options of `add_trial_options`, as arguments of `TrialConfig`."""
    return {n: getattr(arguments, n) for n in ("user", "house", "planner", "fidelity", "regret")}


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
