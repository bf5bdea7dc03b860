"""Options and argument types of several commands. The simulator is not imported, to keep `--help` fast."""

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
from experiments.session.film_config import FRAME_SIZE, FilmConfig
from experiments.trials.attributes import attributes
from experiments.trials.design import numbers
from experiments.trials.trial_config import DEFAULTS, DRAWN_BY, SEEDS, SETTINGS, TrialConfig, episode_settings
from hud.conditions import CONDITIONS, OPTIONS
from mjsim.render.profiles import FAST, MAX_SIDE, PROFILES
from mjsim.values.options import CAPACITIES, FIDELITIES
from mjsim.values.person_parameters import RANGES, PersonParameters
from planner.solvers import SOLVERS

PERSON_VALUES = {  # frequently used person parameters, each of which has its own option
    "walking_speed": "preferred walking speed",
    "turning_speed": "fastest turn of the body",
    "reach": "largest distance, from the body's axis, for picking and placing",
    "field_of_view": "horizontal field of view of the picture and of the participant's perception",
    "reading_time": "how long the participant stands and reads before each visit",
}
PAGE_SETTINGS = ("draw", "field_of_view_range")  # settings that only apply to sessions in a browser
# Settings that are options of `run`, `batch` and `play`
TRIAL_OPTIONS = tuple(
    name
    for name in SETTINGS
    if name not in ("objects", "assistance", "user", "live", "behaviour", "trial_number", *PAGE_SETTINGS)
)
_TYPES, _DESCRIPTIONS = typing.get_type_hints(TrialConfig), attributes(TrialConfig)
_CHOICES: dict[str, tuple[Any, ...]] = {"fidelity": FIDELITIES, "capacity": CAPACITIES, "draw": DRAWN_BY}
_METAVARS = {  # values that are neither a number N nor a NAME
    **dict.fromkeys(("time_limit", *SEEDS), "S"),
    **dict.fromkeys(("episode", "story"), "FILE"),
    "phases": "NAME,..",
    "field_of_view_range": "LOW,HIGH",
    "person": "SPEC",
}


def int_list(text: str) -> list[int]:
    """Parse a list of integers and ranges, such as `6,12` or `0:10`. The end of a range is excluded."""
    try:
        return numbers(text)
    except ConfigError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def text_list(text: str) -> list[str]:
    return [part.strip() for part in text.split(",") if part.strip()]


def frame_size(text: str) -> tuple[int, int]:
    """Parse a frame size such as `640x480`. Width and height must be even, as H.264 requires."""
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
    """Parse a finite, non-negative number of seconds."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0 <= value < math.inf:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of seconds of at least 0")
    return value


class HelpFormatter(argparse.RawDescriptionHelpFormatter, argparse.ArgumentDefaultsHelpFormatter):
    """A help formatter that keeps line breaks in descriptions and shows the default values of options."""

    def _get_help_string(self, action: argparse.Action) -> str | None:
        default, said = action.default, "(default: " in (action.help or "")
        has_default = (
            action.option_strings and action.nargs != 0 and default not in (None, (), [], {}) and not said
        )
        if not has_default:
            return action.help
        value = f"{default:g}" if isinstance(default, float) else "%(default)s"
        return f"{action.help} (default: {value})"


def add_command(
    commands: Any,
    name: str,
    run: Callable[[argparse.Namespace], int],
    description: str,
    summary: str | None = None,
) -> argparse.ArgumentParser:
    """Add a subcommand and return its parser. `summary` is its entry in the help of the parent command."""
    parser: argparse.ArgumentParser = commands.add_parser(
        name, help=summary, description=description, formatter_class=HelpFormatter
    )
    parser.set_defaults(run=run)
    return parser


def add_force(parser: argparse.ArgumentParser, text: str = "replace existing files") -> None:
    parser.add_argument("--force", action="store_true", help=text)


def add_call_limit(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--call-limit",
        type=seconds,
        action=_CallLimit,
        metavar="S",
        help="time limit in seconds for one call of a custom participant, condition or planner; trials that exceed it "
        f"end with an error (default: {CALL_LIMIT}, else no limit)",
    )


class _CallLimit(argparse.Action):
    """An action that stores the limit in an environment variable, which worker processes inherit."""

    def __call__(self, _parser: Any, _namespace: Any, value: Any, _option: Any = None) -> None:
        os.environ[CALL_LIMIT] = str(value)


def add_setting(parser: argparse.ArgumentParser, name: str, **changes: Any) -> None:
    """Add an option for a setting of `TrialConfig`. It defaults to None unless `changes` has a default."""
    text = f"{_DESCRIPTIONS.get(name, name).replace('`', '').rstrip('.')}{NAMES.get(name, str)()}"
    if name in SEEDS:
        text += " (default: the value of --seed)"
    named = isinstance(DEFAULTS[name], str | int) and _TYPES[name] is not bool and "(default" not in text
    if named and "default" not in changes:
        text += f" (default: {DEFAULTS[name]})"
    arguments: dict[str, Any] = {"help": text[0].lower() + text[1:]}
    if _TYPES[name] is bool:
        arguments["action"] = argparse.BooleanOptionalAction
    elif name in _CHOICES:
        arguments |= {"choices": _CHOICES[name], "type": type(_CHOICES[name][0])}
    else:
        arguments["metavar"] = _METAVARS.get(name, "N" if _TYPES[name] is int else "NAME")
        arguments["type"] = {int: int, float | None: seconds}.get(_TYPES[name], str)
    parser.add_argument(f"--{name.replace('_', '-')}", **{**arguments, **changes})


NAMES: dict[str, Callable[[], str]] = {  # functions that list the possible values of a setting in the help
    "user": lambda: (
        f": {', '.join(participant_names())}, or package.module:attribute; follower uses the guidance shown, in any "
        "condition; boltzmann:T chooses a visit that costs r metres more with odds proportional to exp(-r/T)"
    ),
    "assistance": lambda: (
        f": {', '.join(CONDITIONS)}, or package.module:attribute. Options are appended to the name, as in "
        f"optimal-minimap-pin: {', '.join(OPTIONS)} (docs/hud.md)"
    ),
    "training_assistance": lambda: ": as --assistance",
    "planner": lambda: f": {', '.join(SOLVERS)}, or package.module:attribute",
    "person": lambda: (
        ": a TOML file, or in braces such as '{walking_speed = {normal = [1.2, 0.2], min = 0.8}}'"
    ),
}


def add_task_options(parser: argparse.ArgumentParser, objects: int) -> None:
    add_setting(parser, "objects", help=f"number of misplaced objects, 1 to --points (default: {objects})")
    add_setting(parser, "assistance", default="optimal")
    parser.add_argument(
        "--seed",
        type=int,
        default=0,
        metavar="S",
        help="seed of the house, the participant and the task list",
    )


def add_trial_options(parser: argparse.ArgumentParser, **defaults: str) -> None:
    """Add the options that `run`, `batch` and `play` share, with optional `defaults` instead of None."""
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
    return {name: value for name in names if (value := getattr(arguments, name)) is not None}


def trial_options(arguments: argparse.Namespace) -> dict[str, Any]:
    """Convert the options of `add_trial_options` that the user has set to arguments of `TrialConfig`.

    Raises:
        ConfigError: An option contradicts the episode, or the person's parameters are not valid.
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
            "--episode sets the objects and their places; leave out --objects, --points and --house-seed"
        )
    return {**episode_settings(Path(arguments.episode)), **options}


def add_frame(
    parser: argparse.ArgumentParser,
    *,
    size: tuple[int, int] | None = FRAME_SIZE,
    profile: str = FAST.name,
    otherwise: str = "",
) -> None:
    """Add the options `--size` and `--profile`. The text `otherwise` is appended to the help of `--size`."""
    default = f"{size[0]}x{size[1]}" if size else None
    parser.add_argument(
        "--size", type=frame_size, default=default, metavar="WxH", help=f"frame size in pixels{otherwise}"
    )
    parser.add_argument(
        "--profile", default=profile, metavar="NAME", help=f"render profile: {', '.join(PROFILES)}"
    )


def add_language(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--language", default="en", metavar="LANG", help="language of the texts in the film")


def film_config(arguments: argparse.Namespace, *, panels: bool = True) -> FilmConfig:
    """Return the settings of a film. If `panels` is False, the film does not show the panels of the HUD."""
    width, height = arguments.size
    if panels:
        return FilmConfig.with_panels(width, height, arguments.profile)
    return FilmConfig(width, height, arguments.profile)
