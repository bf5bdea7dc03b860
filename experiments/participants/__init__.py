"""Simulated participants, one module each, and what they share: percepts, decisions and walks.

A module of this package that defines `build` is a choice of `--user`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
