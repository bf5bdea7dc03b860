"""Compiled houses, without objects or a person: rooms, receptacles, floor and ray casts."""
