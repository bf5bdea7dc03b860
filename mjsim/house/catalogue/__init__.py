"""The house as files: how it is named, its catalogue, and the models that the catalogue leads to."""
