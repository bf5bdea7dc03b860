"""A model of a participant who has seen the house once.

The model covers perception, memory, choice, compliance and reading times. The parameters of each part are
class fields with distributions and sources (docs/participants.md). Some are fitted to data (docs/paper.md).
"""

import dataclasses
from collections.abc import Mapping
from typing import Any, Final, get_type_hints

import numpy as np

from experiments.house import House
from experiments.participants.base import Participant
from experiments.participants.distribution import Distributions, Parameter, draw
from experiments.participants.guest.model import Behaviour, Guest

PARTS: Final = get_type_hints(Behaviour)
PARAMETERS: Final[Mapping[str, Parameter]] = {
    f"{part}.{field.name}": field.metadata["parameter"]
    for part, kind in PARTS.items()
    for field in dataclasses.fields(kind)
}
# The comfortable walking speed of healthy adults is 0.94 to 1.43 m/s (Bohannon and Williams Andrews, Physiotherapy 97,
# 2011). The distance at which an object is noticed is a parameter of `perception`.
PERSON: Final[Mapping[str, Any]] = {
    "walking_speed": {"normal": [1.2, 0.12], "min": 0.94, "max": 1.43},
    "viewing_distance": 14.0,
}


class _Build:
    """A factory of guests.

    `behaviour` contains the parameters of the model, and `person` contains distributions for the body.
    """

    behaviour = PARAMETERS
    person = PERSON

    def __call__(
        self, house: House, rng: np.random.Generator, behaviour: Mapping[str, float] | None = None
    ) -> Participant:
        """Create a guest with the given parameter values, or with random values by default."""
        values = behaviour or draw(PARAMETERS, Distributions(), rng, "guest")
        return Guest(house, rng, as_behaviour(values))


def as_behaviour(values: Mapping[str, float]) -> Behaviour:
    """Convert parameter values by name, such as `compliance.follows`, to the parts of the model."""
    return Behaviour(
        **{
            part: kind(**{f.name: values[f"{part}.{f.name}"] for f in dataclasses.fields(kind)})
            for part, kind in PARTS.items()
        }
    )


build = _Build()
