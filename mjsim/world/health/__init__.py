"""Health of the physics at every control step: penetration, weld errors, ejections, tunnelling (docs/metrics.md)."""
