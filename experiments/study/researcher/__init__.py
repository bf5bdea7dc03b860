"""The researcher's page of a study with people, on a port of its own; health and metrics."""
