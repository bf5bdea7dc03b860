"""The human participant at the keyboard, who is available only in `mjsim play`."""

from typing import Never

import numpy as np

from experiments.errors import ConfigError
from experiments.house import House


def build(house: House, rng: np.random.Generator) -> Never:  # noqa: ARG001 - the interface of participants
    raise ConfigError("user human is a person at the keyboard; start `mjsim play` instead")
