"""Whether a person has understood the story: questions with choices, asked before the visit begins."""

import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import msgspec

from experiments.errors import ConfigError
from mjsim.support.files import read_text


class Question(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A question, its choices in the order in which they are shown, and the right one."""

    text: str
    choices: list[str]
    answer: str

    def __post_init__(self) -> None:
        if self.answer not in self.choices or len(set(self.choices)) < max(2, len(self.choices)):
            raise ValueError(
                f"question {self.text!r} needs two choices or more, all different, with the answer among them"
            )


class _Check(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    question: Annotated[list[Question], msgspec.Meta(min_length=1)]


def read_questions(path: Path) -> Sequence[Question]:
    """The questions of a TOML file, which has a table `[[question]]` with `text`, `choices` and `answer` for each."""
    try:
        return msgspec.convert(tomllib.loads(read_text(path)), _Check).question
    except OSError as error:
        raise ConfigError(f"cannot read the questions {path}: {error.strerror}") from error
    except (ValueError, msgspec.ValidationError) as error:
        raise ConfigError(f"{path} has no questions: {error}") from error
