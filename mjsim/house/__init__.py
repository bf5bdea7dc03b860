"""Load, compile and validate houses, and build the scenes of episodes."""
