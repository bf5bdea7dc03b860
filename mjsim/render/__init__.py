"""Off-screen rendering, the only part of the project that touches OpenGL.

Each name is loaded at its first use: what only names a profile needs no OpenGL.
"""

from typing import TYPE_CHECKING

from mjsim.support.lazy_names import lazy_names

__all__ = [
    "DRAFT",
    "FAST",
    "PROFILES",
    "QUALITY",
    "CameraPose",
    "FloorPlan",
    "Frame",
    "GlInfo",
    "Labels",
    "LayeredRenderer",
    "MarkerLike",
    "RenderProfile",
    "Renderer",
    "gl_info",
    "largest_scale",
    "render_floorplan",
    "render_house_map",
    "render_picture",
    "render_pictures",
]

if TYPE_CHECKING:
    from mjsim.render.cameras import CameraPose
    from mjsim.render.context import GlInfo, gl_info
    from mjsim.render.labels import Labels
    from mjsim.render.markers import MarkerLike
    from mjsim.render.pictures import (
        FloorPlan,
        largest_scale,
        render_floorplan,
        render_house_map,
        render_picture,
        render_pictures,
    )
    from mjsim.render.profiles import DRAFT, FAST, PROFILES, QUALITY, RenderProfile
    from mjsim.render.renderer import Frame, LayeredRenderer, Renderer
else:  # hidden from type checkers, which would otherwise accept any name
    __getattr__, __dir__ = lazy_names(
        __name__,
        {
            "cameras": ("CameraPose",),
            "context": ("GlInfo", "gl_info"),
            "labels": ("Labels",),
            "markers": ("MarkerLike",),
            "pictures": (
                "FloorPlan",
                "largest_scale",
                "render_floorplan",
                "render_house_map",
                "render_picture",
                "render_pictures",
            ),
            "profiles": ("DRAFT", "FAST", "PROFILES", "QUALITY", "RenderProfile"),
            "renderer": ("Frame", "LayeredRenderer", "Renderer"),
        },
    )
