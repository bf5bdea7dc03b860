"""The participant of `mjsim study rehearse`, who is available only through a study server."""

from typing import Never

import numpy as np

from experiments.errors import ConfigError
from experiments.house import House


def build(house: House, rng: np.random.Generator) -> Never:  # noqa: ARG001 - the interface of participants
    raise ConfigError("user rehearsal plays through a server; start `mjsim study rehearse` instead")
