"""The simulator as a task for agents: one core behind the dm_env and the Gymnasium interface.

    sensors ─┐
    control ─┼─> Rearrangement (core) ─> RearrangeDmEnvironment   mjsim.make(...)
    reward  ─┘                        └> RearrangeEnv             gymnasium.make("mjsim/Rearrange-v0", ...)

Modules are imported where they are needed; importing this package alone costs nothing.
"""
