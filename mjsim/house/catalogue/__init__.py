"""Catalogue files, house names and MJCF model files."""
