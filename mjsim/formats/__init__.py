"""File formats of houses and scenes, with their readers and writers. All readers return a `SourceScene`."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
