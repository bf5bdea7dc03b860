"""Analyse the table of a study with statistical tests and models."""
