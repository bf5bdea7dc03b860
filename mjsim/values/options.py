"""Rules of the world that a study may change."""

import dataclasses
import math
from dataclasses import dataclass

from mjsim.values.episode import CAPACITY
from mjsim.values.errors import ActionError

FIDELITIES = ("full", "event")
CAPACITIES = (1, 2)
REST_STEPS = 4  # control steps in a row below `settle_speed`, after which an object is at rest


@dataclass(frozen=True)
class WorldOptions:
    """Time step, grip, rest and the tier of fidelity; what differs from person to person is in `PersonParameters`.

    Attributes:
        control_timestep: Duration of one `World.step`, s; a multiple of the model's timestep.
        grip_distance: A hand grips only within this distance of the grip site, m.
        grip_error: A weld stretched farther than this slips, m.
        grip_patience: For how long it may stay stretched, s.
        settle_time: How long a released object may take to come to rest, s.
        settle_speed: Slower than this is at rest, m/s.
        volume_margin: How far outside of a receptacle's volume a centre still counts as inside, m.
        fidelity: `full`, everything in physics; `event`, kinematic except for the fall of released objects
            (docs/simulation.md).
        capacity: How many objects are carried at most: 2, or 1 with the right hand alone.

    Raises:
        ActionError: A value is not a positive finite number, there is no such fidelity, or the capacity is not 1 or 2.
    """

    control_timestep: float = 0.04
    grip_distance: float = 0.08
    grip_error: float = 0.009
    grip_patience: float = 0.1
    settle_time: float = 2.5
    settle_speed: float = 0.05
    volume_margin: float = 0.005
    fidelity: str = "full"
    capacity: int = CAPACITY

    def __post_init__(self) -> None:
        if self.fidelity not in FIDELITIES:
            raise ActionError(f"no fidelity {self.fidelity!r}; choose one of {', '.join(FIDELITIES)}")
        if self.capacity not in CAPACITIES:
            raise ActionError(
                f"capacity is {self.capacity!r}; a person with two hands carries 1 or 2 objects"
            )
        for field in dataclasses.fields(self):
            if field.name == "fidelity":
                continue
            value = getattr(self, field.name)
            if not (math.isfinite(value) and value > 0):
                raise ActionError(f"WorldOptions.{field.name} must be a positive number, got {value!r}")
