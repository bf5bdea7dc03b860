"""A running episode: the world that a person acts in, its state, and its tiers of fidelity."""
