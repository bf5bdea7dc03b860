"""Support that has nothing to do with houses: random streams."""
