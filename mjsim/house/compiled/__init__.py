"""Compiled houses without objects and a person: rooms, receptacles, floor, rays."""
