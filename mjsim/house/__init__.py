"""Houses: catalogues, compiled models, episode scenes, visibility and validation."""
