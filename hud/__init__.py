"""The heads-up display (HUD): assistance conditions, the HUD states that they produce, and drawing functions.

The package depends on neither the physics simulation nor the planner.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
