"""Phases of a visit of `mjsim play`, and the questions about its story, as the options say."""

import argparse
import tomllib
from pathlib import Path
from typing import Annotated

import msgspec

from experiments.errors import ConfigError
from experiments.record.phases import FLYTHROUGH, STORY, phases_of
from experiments.visit.texts.items import Item
from mjsim.support.files import read_text


def shown_phases(arguments: argparse.Namespace) -> tuple[str, ...]:
    """The phases of a visit; a fly-through needs a film.

    Raises:
        ConfigError: There is no such phase.
    """
    return tuple(
        name for name in phases_of(arguments.phases) if name != FLYTHROUGH or arguments.film is not None
    )


def questions_of(arguments: argparse.Namespace) -> tuple[Item, ...]:
    """Return the questions of the TOML file of --questions: tables [[question]] with `text`, `choices` and `answer`.

    Raises:
        ConfigError: The file cannot be read or used, or a phase that the options are about is not shown.
    """
    path: Path | None = arguments.questions
    named = {**arguments.minimum, **({STORY: 0.0} if path else {})}
    if missing := [name for name in named if name not in shown_phases(arguments)]:
        raise ConfigError(f"--minimum or --questions is about the phase {missing[0]}, which is not shown")
    if path is None:
        return ()
    try:
        asked = tomllib.loads(read_text(path)).get("question") or []
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
        raise ConfigError(f"{path} has no questions: {error}") from error
