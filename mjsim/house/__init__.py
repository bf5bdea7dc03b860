"""The house as data and as a compiled model: assets, catalogue, scene, sampling, sight, validation.

Serves the world, which steps the model, and every command that needs a house or an episode.
"""
