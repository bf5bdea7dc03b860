"""Composed houses: sampled episodes, settled objects, the person's body, and compiled scenes."""
