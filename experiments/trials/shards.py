"""Shards: shares of a design for the tasks of an array job.

A shard reads and runs only its own trials, and writes no tables. Any number of shards can therefore work in one folder
at the same time.
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
    """One of `count` shares of a design, counted from 1."""

    number: int
    count: int

    @classmethod
    def parse(cls, text: str) -> "Shard":
        """Parse `K/N`; a ConfigError if it is not a shard."""
        found = re.fullmatch(r"(\d{1,9})/(\d{1,9})", text, re.ASCII)
        if not found or not 1 <= int(found[1]) <= int(found[2]):
            raise ConfigError(
                f"{text!r} is not a shard K/N; shards are counted from 1 to N: the first of 40 is 1/40"
            )
        return cls(int(found[1]), int(found[2]))

    def __str__(self) -> str:
        return f"{self.number}/{self.count}"

    @property
    def label(self) -> str:
        """Part of the names of files that only this shard uses."""
        return f"{self.number}-of-{self.count}."

    def of(self, design: Design) -> Design:
        """The trials of this shard, in the design's order; a ConfigError if there are fewer trials than shards."""
        total = len(design.trials)
        if total < self.count:
            raise ConfigError(
                f"{counted(total, 'trial')} cannot be shared by {self.count} shards; use at most {total}"
            )
        numbers = shard_numbers(design.trials, self.count)
        own = [trial for trial, number in zip(design.trials, numbers, strict=True) if number == self.number]
        return dataclasses.replace(design, trials=tuple(own))


def shard_numbers(trials: Sequence[TrialConfig], count: int) -> list[int]:
    """Return the shard of each trial, 1 to `count`. It depends only on the number of trials and on which share a house.

    A shard gets whole houses as far as possible, because making one takes longer than many a trial in it. Within a
    house, trials are mixed, so that no shard gets only the trials with the most objects.
    """
    houses = {house: k for k, house in enumerate(dict.fromkeys(trial.house for trial in trials))}
    order = sorted(range(len(trials)), key=lambda k: (houses[trials[k].house], _mixed(k)))
    numbers = [0] * len(trials)
    for place, k in enumerate(order):
        numbers[k] = ((place + 1) * count - 1) // len(trials) + 1
    return numbers


def _mixed(number: int) -> bytes:
    return hashlib.sha256(str(number).encode()).digest()
