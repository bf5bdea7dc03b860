"""Running episodes: the world, its state, and its two levels of fidelity."""
