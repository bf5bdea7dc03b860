from .control import Continuous as Continuous, Discrete as Discrete
from .core import ObservationDict as ObservationDict, Rearrangement as Rearrangement
from .gymnasium_environment import RearrangeEnv as RearrangeEnv
from .options import EnvironmentOptions as EnvironmentOptions
from .rewards import TimeReward as TimeReward
from .sensors.base import Sensor as Sensor, SensorInput as SensorInput, unit_spec as unit_spec
