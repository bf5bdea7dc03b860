"""Running episodes: the world, its state, and its tiers of fidelity."""
