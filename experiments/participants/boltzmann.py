"""A participant who chooses visits at random, but prefers visits with a low regret.

The probability of a visit that makes the remaining task r metres longer is proportional to
exp(-r / temperature). The temperature in metres is part of the name, as in `--user boltzmann:0.5`. With a
temperature of 0 m, all visits are optimal. Above about 10 m, they are almost random.
"""

import math
from collections.abc import Sequence

import numpy as np

from experiments.errors import ConfigError
from experiments.house import House
from experiments.participants.base import Choice, Participant, ParticipantFactory, Percept
from experiments.participants.visit_executor import VisitExecutor
from mjsim.values.actions import WAIT, Action
from planner.plan import Visit

TEMPERATURE = 0.5  # default temperature in metres


def draw(choices: Sequence[Choice], temperature: float, rng: np.random.Generator) -> Choice:
    """Draw a choice with probability proportional to exp(-regret / temperature).

    At temperature 0, the best choice is returned. If the regret of a drawn choice is capped, the exact one is
    computed, and the choice is rejected with a probability that makes the distribution exact.
    """
    if temperature <= 0:
        return min(choices, key=lambda choice: choice.regret)
    regrets = np.array([choice.regret for choice in choices])
    exact = [not choice.capped for choice in choices]
    while True:
        weights = np.exp((regrets.min() - regrets) / temperature)
        k = int(rng.choice(len(choices), p=weights / weights.sum()))
        if exact[k]:
            return choices[k]
        truth = choices[k].find_exact()
        excess = max(0.0, truth - regrets[k]) if truth is not None else 0.0
        if rng.random() < math.exp(-excess / temperature):
            return choices[k]
        regrets[k], exact[k] = regrets[k] + excess, True


class Boltzmann:
    """A participant who draws a visit at random and pursues it until it is finished or impossible."""

    needs: frozenset[str] = frozenset()

    def __init__(self, house: House, rng: np.random.Generator, temperature: float) -> None:
        self._executor = VisitExecutor(house)
        self._rng = rng
        self._temperature = temperature
        self._choice: Visit | None = None

    def act(self, percept: Percept) -> Action:
        if self._executor.waits(percept):
            return WAIT
        choices = {choice.visit: choice for choice in percept.choices}
        if not choices:
            return WAIT
        if self._choice not in choices:
            self._choice = draw(list(choices.values()), self._temperature, self._rng).visit
        chosen = choices[self._choice]
        return self._executor.act(percept, chosen.visit, {chosen.visit.object: chosen.goal})


def with_parameter(text: str) -> ParticipantFactory:
    """Return a factory of Boltzmann participants. `text` is a temperature. Raises ConfigError if it is invalid."""
    try:
        temperature = float(text)
    except ValueError:
        temperature = math.nan
    if not 0 <= temperature < math.inf:
        raise ConfigError(f"the temperature of boltzmann must be a number of metres from 0 on, got {text!r}")

    def make(house: House, rng: np.random.Generator) -> Participant:
        return Boltzmann(house, rng, temperature)

    return make


def build(house: House, rng: np.random.Generator) -> Participant:
    return Boltzmann(house, rng, TEMPERATURE)
