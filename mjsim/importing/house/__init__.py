"""Importer for houses from scenes of other simulators (docs/import.md)."""
