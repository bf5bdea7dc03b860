"""The participant of `mjsim study rehearse`, who plays through the study's server; no trial simulates it otherwise."""

from typing import Never

import numpy as np

from experiments.errors import ConfigError
from experiments.house import House


def build(house: House, rng: np.random.Generator) -> Never:  # noqa: ARG001 - the interface of participants
    """Refuse to simulate the participant of a rehearsal."""
    raise ConfigError("user rehearsal plays through a server; start `mjsim study rehearse` instead")
