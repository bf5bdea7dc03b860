"""Options that say who takes part."""

import argparse
from typing import Any

from experiments.trials.person_distribution import PersonDistribution
from mjsim.person_parameters import RANGES, PersonParameters

_VALUES = {
    "walking_speed": "usual walk",
    "turning_speed": "fastest turn of the body",
    "reach": "how far away, from the body's axis, something can be picked or placed",
    "field_of_view": "horizontal field of view of the picture and of what the participant perceives",
    "reading_time": "for how long the participant stands and reads before each visit",
}
PERSON_OPTIONS = ("person", *_VALUES)


def add_person_options(parser: argparse.ArgumentParser) -> None:
    """Add `--person`, and an option for each of the values that are changed most."""
    parser.add_argument(
        "--person",
        metavar="SPEC",
        help="distributions of the person's values, drawn by the person's seed: a TOML file, or in braces such as "
        "'{walking_speed = {normal = [1.2, 0.2], min = 0.8}}' (docs/people.md)",
    )
    usual = PersonParameters()
    for name, what in _VALUES.items():
        low, high, unit = RANGES[name]
        parser.add_argument(
            f"--{name.replace('_', '-')}",
            type=float,
            metavar=unit.upper(),
            help=f"{what}, {low:.4g} to {high:.4g} {unit} (default: {getattr(usual, name):.4g})",
        )


def person_options(arguments: argparse.Namespace) -> dict[str, Any]:
    """What the options say of the person, as an argument of `TrialConfig`; nothing if none is given.

    Raises:
        ConfigError: A value or the description is unusable.
    """
    values = {name: value for name in _VALUES if (value := getattr(arguments, name)) is not None}
    if arguments.person is None and not values:
        return {}
    described = (
        PersonDistribution() if arguments.person is None else PersonDistribution.parse(arguments.person)
    )
    return {"person": described.updated(PersonDistribution.of(values))}
