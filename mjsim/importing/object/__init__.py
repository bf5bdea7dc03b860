"""Importer for objects from mesh files into a house's catalogue."""
