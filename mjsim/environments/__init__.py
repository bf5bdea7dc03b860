"""The simulator as a task for agents: one core behind the dm_env and the Gymnasium interface.

    sensors ─┐
    control ─┼─> Rearrangement (core) ─> RearrangeDmEnvironment   mjsim.make(...)
    reward  ─┘                        └> RearrangeEnv             gymnasium.make(...)

Importing it registers the Gymnasium environment, as Gymnasium expects of packages with environments.
"""

from typing import TYPE_CHECKING

from gymnasium.envs.registration import register

from mjsim.support.lazy_names import lazy_names

__all__ = [
    "Continuous",
    "Discrete",
    "EnvironmentOptions",
    "ObservationDict",
    "RearrangeEnv",
    "Rearrangement",
    "Sensor",
    "SensorInput",
    "TimeReward",
    "unit_spec",
]

ENVIRONMENT_ID = "mjsim/Rearrange-v0"

register(ENVIRONMENT_ID, entry_point="mjsim.environments.gymnasium_environment:RearrangeEnv")

if TYPE_CHECKING:
    from mjsim.environments.control import Continuous, Discrete
    from mjsim.environments.core import ObservationDict, Rearrangement
    from mjsim.environments.gymnasium_environment import RearrangeEnv
    from mjsim.environments.options import EnvironmentOptions
    from mjsim.environments.rewards import TimeReward
    from mjsim.environments.sensors.base import Sensor, SensorInput, unit_spec
else:  # hidden from type checkers, which would otherwise accept any name
    __getattr__, __dir__ = lazy_names(
        __name__,
        {
            "control": ("Continuous", "Discrete"),
            "core": ("ObservationDict", "Rearrangement"),
            "gymnasium_environment": ("RearrangeEnv",),
            "options": ("EnvironmentOptions",),
            "rewards": ("TimeReward",),
            "sensors.base": ("Sensor", "SensorInput", "unit_spec"),
        },
    )
