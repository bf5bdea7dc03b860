"""Navmesh, geodesic distances, and the routing problem of a task with its planners.

The package works with distances and names only. Sessions use `Planner`, and `mjsim plan` uses `solver`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
