"""Options of the physics simulation."""

import dataclasses
import math
from dataclasses import dataclass

from mjsim.values.episode import CAPACITY
from mjsim.values.errors import ActionError

FIDELITIES = ("full", "event")
CAPACITIES = (1, 2)
REST_STEPS = 4  # number of slow control steps in a row after which an object is at rest


@dataclass(frozen=True)
class WorldOptions:
    """Options of a simulated world that do not depend on the person.

    Attributes:
        control_timestep: Duration of a control step in seconds, which is a multiple of the model's timestep.
        grip_distance: Maximum distance between a hand and an object's grip site for a grip, in metres.
        grip_error: Stretch of the weld between hand and object beyond which the object slips, in metres.
        grip_patience: Time for which the stretch may exceed `grip_error`, in seconds.
        settle_time: Maximum time for a released object to come to rest, in seconds.
        settle_speed: Speed below which an object counts as being at rest, in m/s.
        volume_margin: Distance from a receptacle's volume up to which an object's centre counts as inside, in
            metres.
        fidelity: `full` simulates all motions with physics. `event` moves the person kinematically, and uses physics
            only for the fall of released objects (docs/simulation.md).
        capacity: Number of objects that can be carried, which is 2, or 1 to use only the right hand.

    Raises:
        ActionError: A number is not positive and finite, the fidelity is unknown, or the capacity is not 1 or 2.
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
