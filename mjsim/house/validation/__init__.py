"""Rules that check houses, receptacles and objects (docs/models.md). Each rule yields findings."""
