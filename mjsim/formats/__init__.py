"""File formats of houses and scenes, each with its readers and writers. Readers return a `SourceScene`."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
