"""Option types and options that several subcommands share. Nothing here loads the simulator: `--help` is quick."""

import argparse
import math
import os
import re
import typing
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from experiments.errors import CALL_LIMIT, ConfigError
from experiments.participants.distribution import Distributions
from experiments.participants.registry import participant_names
from experiments.session.film_config import FilmConfig
from experiments.trials.design import numbers
from experiments.trials.trial_config import DEFAULTS, SETTINGS, TrialConfig, episode_settings
from hud.conditions import CONDITIONS, OPTIONS
from mjsim.render.profiles import FAST, MAX_SIDE, PROFILES
from mjsim.values.person_parameters import RANGES, PersonParameters
from planner.solvers import SOLVERS

PERSON_VALUES = {  # options of their own, because they are changed most
    "walking_speed": "usual walk",
    "turning_speed": "fastest turn of the body",
    "reach": "how far away, from the body's axis, something can be picked or placed",
    "field_of_view": "horizontal field of view of the picture and of what the participant perceives",
    "reading_time": "for how long the participant stands and reads before each visit",
}
PAGE_SETTINGS = ("draw", "field_of_view_range")  # of the page of `mjsim play`
# The settings that run, batch and play have in common.
TRIAL_OPTIONS = tuple(
    name
    for name in SETTINGS
    if name not in ("objects", "assistance", "user", "live", "behaviour", "trial_number", *PAGE_SETTINGS)
)
_TYPES = typing.get_type_hints(TrialConfig)


def int_list(text: str) -> list[int]:
    """Parse `6,12` or `0:10` (the end not included) or a mix of both."""
    try:
        return numbers(text)
    except ConfigError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def text_list(text: str) -> list[str]:
    """Parse `none,highlight`."""
    return [part.strip() for part in text.split(",") if part.strip()]


def frame_size(text: str) -> tuple[int, int]:
    """Parse `640x480`; even, because H.264 needs that."""
    match = re.fullmatch(r"(\d+)x(\d+)", text)
    if not match:
        raise argparse.ArgumentTypeError(f"{text!r} is not of the form WIDTHxHEIGHT, such as 640x480")
    width, height = int(match[1]), int(match[2])
    if width % 2 or height % 2 or width < 320 or height < 240 or max(width, height) > MAX_SIDE:
        raise argparse.ArgumentTypeError(
            f"{text} must be even in both directions, at least 320x240 and at most {MAX_SIDE}x{MAX_SIDE}"
        )
    return width, height


def seconds(text: str) -> float:
    """Parse a time, s, finite and not negative."""
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
    commands: Any,
    name: str,
    run: Callable[[argparse.Namespace], int],
    *,
    description: str,
    summary: str | None = None,
) -> argparse.ArgumentParser:
    """Add a subcommand; `summary` is its line in a list of subcommands (`mjsim --help` has its own)."""
    parser: argparse.ArgumentParser = commands.add_parser(
        name, help=summary, description=description, formatter_class=HelpFormatter
    )
    parser.set_defaults(run=run)
    return parser


def add_force(parser: argparse.ArgumentParser, text: str = "replace files that exist") -> None:
    """Add `--force`."""
    parser.add_argument("--force", action="store_true", help=text)


def add_call_limit(parser: argparse.ArgumentParser) -> None:
    """Add `--call-limit`."""
    parser.add_argument(
        "--call-limit",
        type=seconds,
        action=_CallLimit,
        metavar="S",
        help="longest time that a call of a participant, condition or planner of your own may take, s; the trial then "
        f"ends with an error (default: {CALL_LIMIT}, else no limit)",
    )


class _CallLimit(argparse.Action):
    """Workers take the limit from the environment, as it is no property of a trial."""

    def __call__(self, _parser: Any, _namespace: Any, value: Any, _option: Any = None) -> None:
        os.environ[CALL_LIMIT] = str(value)


def add_setting(parser: argparse.ArgumentParser, name: str, **changes: Any) -> None:
    """Add the option of a setting, described as in `TrialConfig`; it is None where it is not given."""
    extra, option = dict(SETTINGS[name].extra or {}), f"--{name.replace('_', '-')}"
    text = f"{str(SETTINGS[name].description).replace('`', '').rstrip('.')}{NAMES.get(name, str)()}"
    named = isinstance(DEFAULTS[name], str | int) and _TYPES[name] is not bool and "(default" not in text
    if named and "default" not in changes:
        text += f" (default: {DEFAULTS[name]})"
    arguments: dict[str, Any] = {"help": text[0].lower() + text[1:]}
    if _TYPES[name] is bool:
        arguments["action"] = argparse.BooleanOptionalAction
    else:
        arguments |= {key: extra[key] for key in ("metavar", "choices") if key in extra}
        arguments["type"] = {int: int, float | None: seconds}.get(_TYPES[name], str)
    parser.add_argument(option, **{**arguments, **changes})


NAMES: dict[str, Callable[[], str]] = {  # what can be named, for help
    "user": lambda: (
        f": {', '.join(participant_names())}, or package.module:attribute; follower uses whatever guidance is shown, "
        "in any condition; boltzmann:T chooses a visit that costs r metres more with odds exp(-r/T)"
    ),
    "assistance": lambda: (
        f": {', '.join(CONDITIONS)}, or package.module:attribute; "
        f"{', '.join(f'-{name}' for name in OPTIONS)} may follow"
    ),
    "training_assistance": lambda: ": as --assistance",
    "planner": lambda: f": {', '.join(SOLVERS)}, or package.module:attribute",
    "person": lambda: (
        ": a TOML file, or in braces such as '{walking_speed = {normal = [1.2, 0.2], min = 0.8}}'"
    ),
}


def add_task_options(parser: argparse.ArgumentParser, objects: int) -> None:
    """Add `--objects`, `--assistance` and `--seed` of a single trial."""
    add_setting(parser, "objects", help=f"number of misplaced objects, 1 to --points (default: {objects})")
    add_setting(parser, "assistance", default="optimal")
    parser.add_argument(
        "--seed", type=int, default=0, metavar="S", help="seed of the house, the participant and the list"
    )


def add_trial_options(parser: argparse.ArgumentParser, **defaults: str) -> None:
    """Add the settings that run, batch and play have in common; options without a default are None if not given."""
    for name in TRIAL_OPTIONS:
        add_setting(parser, name, **({"default": defaults[name]} if name in defaults else {}))
    usual = PersonParameters()
    for name, what in PERSON_VALUES.items():
        low, high, unit = RANGES[name]
        parser.add_argument(
            f"--{name.replace('_', '-')}",
            type=float,
            metavar=unit.upper(),
            help=f"{what}, {low:.4g} to {high:.4g} {unit} (default: {getattr(usual, name):.4g})",
        )


def given_options(arguments: argparse.Namespace, names: Sequence[str]) -> dict[str, Any]:
    """The options of these names that are given."""
    return {name: value for name in names if (value := getattr(arguments, name)) is not None}


def trial_options(arguments: argparse.Namespace) -> dict[str, Any]:
    """The options of `add_trial_options` that are given, as arguments of `TrialConfig`.

    Raises:
        ConfigError: An episode is given together with what it decides, or no such person is possible.
        EpisodeError: The episode cannot be read.
    """
    options = given_options(arguments, tuple(name for name in TRIAL_OPTIONS if name != "person"))
    if given_options(arguments, ("person", *PERSON_VALUES)):
        described = Distributions() if arguments.person is None else Distributions.parse(arguments.person)
        values = Distributions.of(given_options(arguments, tuple(PERSON_VALUES)))
        options["person"] = described.updated(values)
    if arguments.episode is None:
        return options
    if arguments.objects is not None or arguments.house_seed is not None or arguments.points is not None:
        raise ConfigError(
            "--episode says which objects lie where; leave out --objects, --points and --house-seed"
        )
    return {**episode_settings(Path(arguments.episode)), **options}


def add_frame(
    parser: argparse.ArgumentParser,
    *,
    size: tuple[int, int] | None = (640, 480),
    profile: str = FAST.name,
    otherwise: str = "",
) -> None:
    """Add `--size` and `--profile` with these defaults; `otherwise` tells what no size means."""
    default = f"{size[0]}x{size[1]}" if size else None
    parser.add_argument(
        "--size", type=frame_size, default=default, metavar="WxH", help=f"frame size, px{otherwise}"
    )
    parser.add_argument(
        "--profile", default=profile, metavar="NAME", help=f"render profile: {', '.join(PROFILES)}"
    )


def add_language(parser: argparse.ArgumentParser) -> None:
    """Add `--language`."""
    parser.add_argument(
        "--language", default="en", metavar="LANG", help="language of the words in the film (default: en)"
    )


def film_config(arguments: argparse.Namespace) -> FilmConfig:
    """The options of `add_frame`."""
    width, height = arguments.size
    return FilmConfig(width, height, arguments.profile)
