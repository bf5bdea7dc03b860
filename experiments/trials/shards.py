"""Shards: parts of a design, one for each task of an array job.

A shard reads and runs only its own trials and writes no tables, so several shards can work in the same folder at the
same time.
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
    """One of `count` parts of a design. Numbers start at 1."""

    number: int
    count: int

    @classmethod
    def parse(cls, text: str) -> "Shard":
        """Parse `K/N`. Raises a `ConfigError` if the text is not a shard."""
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
        """Part of the names of files that only this shard uses."""
        return f"{self.number}-of-{self.count}."

    def of(self, design: Design) -> Design:
        """Return the trials of this shard, in the design's order."""
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

    The result depends only on the number of trials and their houses. A shard contains whole houses if possible, because
    making a house takes longer than many trials. The trials of a house are shuffled, so that the shards take similar
    times.
    """
    houses = {house: k for k, house in enumerate(dict.fromkeys(trial.house for trial in trials))}
    order = sorted(range(len(trials)), key=lambda k: (houses[trials[k].house], _shuffle_key(k)))
    numbers = [0] * len(trials)
    for rank, k in enumerate(order):
        numbers[k] = ((rank + 1) * count - 1) // len(trials) + 1
    return numbers


def _shuffle_key(number: int) -> bytes:
    return hashlib.sha256(str(number).encode()).digest()
