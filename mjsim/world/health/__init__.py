"""Checks for physics problems such as penetration and ejected objects (docs/metrics.md)."""
