"""Houses as data and as compiled models: catalogue, scene, sampling, sight, validation."""
