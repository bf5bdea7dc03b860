"""The simulator as a task for agents: one core behind the dm_env and the Gymnasium interface.

    sensors ─┐
    control ─┼─> Rearrangement (core) ─> RearrangeDmEnvironment   mjsim.make(...)
    reward  ─┘                        └> RearrangeEnv             gymnasium.make(...)

Importing it registers the Gymnasium environment, as Gymnasium expects of packages with environments.
"""

from gymnasium.envs.registration import register

ENVIRONMENT_ID = "mjsim/Rearrange-v0"

register(ENVIRONMENT_ID, entry_point="mjsim.environments.gymnasium_environment:RearrangeEnv")
