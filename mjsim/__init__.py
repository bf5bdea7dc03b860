"""Physics side of the rearrangement simulator: houses, episodes, world, observation and rendering."""
