"""Compile houses, and query their rooms, receptacles and walkable floor."""
