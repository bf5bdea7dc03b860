"""Houses as files: names, catalogues and model files."""
