"""Off-screen rendering, the only part of the project that touches OpenGL."""

from mjsim.render.cameras import CameraPose
from mjsim.render.context import GlInfo, gl_info
from mjsim.render.floorplan import FloorPlan, largest_scale, render_floorplan, render_house_map
from mjsim.render.labels import Labels
from mjsim.render.layered import LayeredRenderer
from mjsim.render.markers import MarkerLike
from mjsim.render.pictures import render_picture, render_pictures
from mjsim.render.profiles import DRAFT, FAST, PROFILES, QUALITY, RenderProfile
from mjsim.render.renderer import Frame, Renderer

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
