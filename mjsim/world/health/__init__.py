"""Health of the physics at every control step: penetration, weld errors, ejections and tunnelling (docs/metrics.md)."""
