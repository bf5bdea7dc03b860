"""Option types and options that several subcommands share."""

import argparse
import re

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


def add_house(parser: argparse.ArgumentParser) -> None:
    """Add `--house`."""
    parser.add_argument(
        "--house",
        default="apartment",
        metavar="NAME",
        help="house by name, or path of its catalogue.toml (apartment)",
    )


def add_user(parser: argparse.ArgumentParser) -> None:
    """Add `--user`."""
    parser.add_argument(
        "--user",
        metavar="NAME",
        help=f"simulated participant: {', '.join(participant_names())}, or package.module:attribute; "
        "boltzmann:T takes a step that costs r m more with odds exp(-r/T) "
        "(default: the one that makes the most of the assistance)",
    )


def add_planner(parser: argparse.ArgumentParser) -> None:
    """Add `--planner`."""
    parser.add_argument(
        "--planner",
        default=DEFAULT_SOLVER,
        metavar="NAME",
        help=f"solver of the routing problem: {', '.join(SOLVERS)} ({DEFAULT_SOLVER})",
    )


def add_fidelity(parser: argparse.ArgumentParser) -> None:
    """Add `--fidelity`."""
    parser.add_argument(
        "--fidelity",
        choices=FIDELITIES,
        default=WorldOptions.fidelity,
        help="full: everything in physics; windows: physics for picks and places, kinematic walking in between; "
        f"event: kinematic but for what falls ({WorldOptions.fidelity}; docs/fidelity.md)",
    )


def add_regret(parser: argparse.ArgumentParser) -> None:
    """Add `--no-regret`."""
    parser.add_argument(
        "--no-regret",
        dest="regret",
        action="store_false",
        help="do not work out what each visit cost compared with the best one (up to a second a trial)",
    )


def add_frame(
    parser: argparse.ArgumentParser, *, size: tuple[int, int] = (640, 480), profile: str = FAST.name
) -> None:
    """Add `--size` and `--profile` with these defaults."""
    shown = f"{size[0]}x{size[1]}"
    parser.add_argument(
        "--size", type=frame_size, default=size, metavar="WxH", help=f"frame size in pixels ({shown})"
    )
    parser.add_argument(
        "--profile",
        default=profile,
        metavar="NAME",
        help=f"render profile: {', '.join(PROFILES)} ({profile})",
    )


def assistance_help() -> str:
    """What `--assistance` can be."""
    options = ", ".join(f"-{name}" for name in option_names())
    names = ", ".join(condition_names())
    return f"assistance condition: {names}, or package.module:attribute; {options} may follow"
