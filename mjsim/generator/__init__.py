"""Homes generated from a seed: rooms, doors, windows, furniture and bins. Every process generates the same bytes."""
