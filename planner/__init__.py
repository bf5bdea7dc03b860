"""Navigation meshes, geodesic distances, routing problems and planners.

Planners need only distances and object names. Sessions use `Planner`, and `mjsim plan` uses `solver`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
