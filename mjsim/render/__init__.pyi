from .cameras import CameraPose
from .context import GlInfo, gl_info
from .labels import Labels
from .markers import MarkerLike
from .pictures import (
    FloorPlan,
    largest_scale,
    render_floorplan,
    render_house_map,
    render_picture,
    render_pictures,
)
from .profiles import DRAFT, FAST, PROFILES, QUALITY, RenderProfile
from .renderer import Frame, LayeredRenderer, Renderer

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
