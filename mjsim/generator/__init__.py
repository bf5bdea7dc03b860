"""Houses made from a seed: rooms, doors, windows, furniture and bins, the same bytes in every process."""
