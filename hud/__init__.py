"""The heads-up display: assistance conditions, the HUD states that they return, and the code that draws them.

The package depends neither on the physics nor on the planner.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
