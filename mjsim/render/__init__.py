"""Off-screen rendering, the only part of `mjsim` that uses OpenGL. Names are loaded at their first use."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
