"""The world of a running episode, its state, and its two levels of fidelity."""
