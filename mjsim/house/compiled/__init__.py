"""Compiled houses without objects or a person: rooms, receptacles, walkable floor and ray casts."""
