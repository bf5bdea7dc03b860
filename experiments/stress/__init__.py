"""Stress tests of the physics: many small sessions that look for what goes wrong (docs/health.md)."""
