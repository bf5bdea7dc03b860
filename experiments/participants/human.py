"""A person at the keyboard. `mjsim play` runs sessions with one; nothing simulates it."""

from typing import Never

import numpy as np

from experiments.errors import ConfigError
from experiments.house import House


def build(house: House, rng: np.random.Generator) -> Never:  # noqa: ARG001 - the interface of participants
    """Refuse to simulate a person."""
    raise ConfigError("user human is a person at the keyboard; start `mjsim play` instead")
