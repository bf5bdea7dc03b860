"""Health of the physics at every control step: penetration, weld errors, ejections, tunnelling (docs/metrics.md).

Serves the tiers, which measure it, and the records and benchmarks that report it.
"""
