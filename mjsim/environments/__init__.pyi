from .control import Continuous, Discrete
from .core import ObservationDict, Rearrangement
from .gymnasium_environment import RearrangeEnv
from .options import EnvironmentOptions
from .rewards import TimeReward
from .sensors.base import Sensor, SensorInput, unit_spec

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
