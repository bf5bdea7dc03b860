"""Off-screen rendering, the only part of the project that touches OpenGL.

Each name is loaded at its first use: what only names a profile needs no OpenGL.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
