"""Import houses from scenes of other simulators (docs/import.md)."""
