"""File formats of houses and scenes, each with its readers and writers. Readers return a `SourceScene`."""

from typing import TYPE_CHECKING

from mjsim.support.lazy_names import lazy_names

__all__ = ["export_scene"]

if TYPE_CHECKING:
    from mjsim.formats.gltf.export import export_scene
else:  # hidden from type checkers, which would otherwise accept any name
    __getattr__, __dir__ = lazy_names(__name__, {"gltf.export": ("export_scene",)})
