"""Simulated participants.

A module that defines `build` can be selected with the option `--user`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
