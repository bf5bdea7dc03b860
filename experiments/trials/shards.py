"""Split a design into shards, for example one for each task of an array job.

A shard reads and runs only its own trials and writes no tables. Several shards can therefore be run in the
same folder at the same time.
"""

import dataclasses
import hashlib
import re
from collections.abc import Sequence
from dataclasses import dataclass

from experiments.errors import ConfigError
from experiments.trials.design import Design, counted
from experiments.trials.trial_config import TrialConfig


@dataclass(frozen=True)
class Shard:
    """One of `count` parts of a design. The number of the first part is 1."""

    number: int
    count: int

    @classmethod
    def parse(cls, text: str) -> "Shard":
        """Parse a shard from text of the form `K/N`. Raises `ConfigError` if the text is invalid."""
        found = re.fullmatch(r"(\d{1,9})/(\d{1,9})", text, re.ASCII)
        if not found or not 1 <= int(found[1]) <= int(found[2]):
            raise ConfigError(
                f"{text!r} is not a shard K/N; the first of 40 shards is 1/40, and the last is 40/40"
            )
        return cls(int(found[1]), int(found[2]))

    def __str__(self) -> str:
        return f"{self.number}/{self.count}"

    @property
    def label(self) -> str:
        """A label that is part of the names of this shard's files."""
        return f"{self.number}-of-{self.count}."

    def of(self, design: Design) -> Design:
        """Return the part of a design that belongs to this shard, in the same order."""
        total = len(design.trials)
        if total < self.count:
            raise ConfigError(
                f"{counted(total, 'trial')} cannot be shared by {self.count} shards; use at most {total}"
            )
        numbers = shard_numbers(design.trials, self.count)
        own = [trial for trial, number in zip(design.trials, numbers, strict=True) if number == self.number]
        return dataclasses.replace(design, trials=tuple(own))


def shard_numbers(trials: Sequence[TrialConfig], count: int) -> list[int]:
    """Return the shard number of each trial, from 1 to `count`.

    The result depends only on the number of trials and their houses. If possible, all trials of a house are
    in the same shard, because creating a house takes longer than many trials. The trials of a house are
    shuffled so that all shards take a similar time.
    """
    houses = {house: k for k, house in enumerate(dict.fromkeys(trial.house for trial in trials))}
    order = sorted(range(len(trials)), key=lambda k: (houses[trials[k].house], _shuffle_key(k)))
    numbers = [0] * len(trials)
    for rank, k in enumerate(order):
        numbers[k] = ((rank + 1) * count - 1) // len(trials) + 1
    return numbers


def _shuffle_key(number: int) -> bytes:
    return hashlib.sha256(str(number).encode()).digest()
