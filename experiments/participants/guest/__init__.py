"""A simulated person who was shown the house once: notices, remembers, chooses, complies or not, takes time.

Each part of the model is a module with its parameters, their distributions over people, units and sources.
`docs/participants.md` lists them, `docs/paper.md` names those that are fitted.
"""

import dataclasses
from collections.abc import Mapping
from typing import Any, Final, get_type_hints

import numpy as np

from experiments.house import House
from experiments.participants.base import Participant
from experiments.participants.behaviour import Parameter, draw
from experiments.participants.distribution import Distributions
from experiments.participants.guest.model import Behaviour, Guest

PARTS: Final = get_type_hints(Behaviour)
PARAMETERS: Final[Mapping[str, Parameter]] = {
    f"{part}.{field.name}": field.metadata["parameter"]
    for part, kind in PARTS.items()
    for field in dataclasses.fields(kind)
}
# Comfortable gait of healthy adults is 0.94 to 1.43 m/s (Bohannon and Williams Andrews, Physiotherapy 97, 2011). How
# far away an object is noticed is up to the part `perception`.
PERSON: Final[Mapping[str, Any]] = {
    "walking_speed": {"normal": [1.2, 0.12], "min": 0.94, "max": 1.43},
    "viewing_distance": 14.0,
}


class _Build:
    """Makes guests.

    Attributes:
        behaviour: Parameters of the model by name.
        person: How the bodies of guests are distributed.
    """

    behaviour = PARAMETERS
    person = PERSON

    def __call__(
        self, house: House, rng: np.random.Generator, behaviour: Mapping[str, float] | None = None
    ) -> Participant:
        """Make a guest with these values; where none are given, they are drawn."""
        values = behaviour or draw(PARAMETERS, Distributions(), rng, "guest")
        return Guest(house, rng, as_behaviour(values))


def as_behaviour(values: Mapping[str, float]) -> Behaviour:
    """The parts of a person from all values by name (`compliance.follows`)."""
    return Behaviour(
        **{
            part: kind(**{f.name: values[f"{part}.{f.name}"] for f in dataclasses.fields(kind)})
            for part, kind in PARTS.items()
        }
    )


build = _Build()
