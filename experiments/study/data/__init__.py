"""Collect, export and delete the data of a study."""
