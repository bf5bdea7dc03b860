"""Reinforcement-learning environments with dm_env and Gymnasium interfaces, which share one core.

    sensors ─┐
    control ─┼─> Rearrangement (core) ─> RearrangeDmEnvironment   mjsim.make(...)
    reward  ─┘                        └> RearrangeEnv             gymnasium.make(...)

Importing this package registers the Gymnasium environment.
"""

import lazy_loader
from gymnasium.envs.registration import register

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

register("mjsim/Rearrange-v0", entry_point="mjsim.environments.gymnasium_environment:RearrangeEnv")
