"""Readers and writers for house and scene file formats. Every reader returns a `SourceScene`."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
