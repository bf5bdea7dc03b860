"""The house as data and as a compiled model: assets, catalogue, scene, sampling."""
