"""The simulator as a task for agents: one core behind the dm_env and the Gymnasium interface.

    sensors ─┐
    control ─┼─> Rearrangement (core) ─> RearrangeDmEnvironment   mjsim.make(...)
    reward  ─┘                        └> RearrangeEnv             gymnasium.make("mjsim/Rearrange-v0", ...)

This package itself imports nothing; import the modules that you need.
"""
