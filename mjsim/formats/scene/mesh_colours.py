"""Read the colours and textures of trimesh meshes."""

from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from trimesh.visual.color import linear_to_srgb

from mjsim.formats.scene.surface import Floats, Surface

PLAIN = (0.74, 0.72, 0.68)  # RGB colour of meshes without a colour
_TRANSLUCENT = ("BLEND", "MASK")  # alpha modes of glTF materials that use the alpha channel
_OPAQUE = 0.5  # minimum mean opacity of meshes that are drawn, because imported surfaces have no transparency


def surface_of(mesh: trimesh.Trimesh, *, linear: bool, side: int | None = None) -> Surface:
    """Convert a trimesh mesh to a surface.

    Args:
        mesh: The mesh to convert.
        linear: True if plain colours are linear, as in glTF.
        side: Maximum side length of the image in pixels. Larger images are reduced. None keeps the image
            unchanged.
    """
    count = len(mesh.faces)
    corners = np.asarray(mesh.triangles, np.float64)
    colours, uv = np.ones((count, 3, 3)), np.zeros((count, 3, 2))
    colours[:] = PLAIN
    picture = None
    visual = mesh.visual
    if visual.kind == "texture":
        colours[:], picture = _material(visual.material, side)
        if visual.uv is None or len(visual.uv) != len(mesh.vertices):
            picture = None
        else:
            uv = np.asarray(visual.uv, np.float64)[mesh.faces]
        if (shades := visual.vertex_attributes.get("color")) is not None:
            plain = getattr(visual.material, "baseColorFactor", None) is None  # white in glTF
            colours = (1.0 if plain else colours) * _unit(shades)[mesh.faces][..., :3]
    elif visual.kind == "vertex":
        colours = np.asarray(visual.vertex_colors, np.float64)[mesh.faces][..., :3] / 255
    elif visual.kind == "face":
        colours = np.repeat(np.asarray(visual.face_colors, np.float64)[:, None, :3] / 255, 3, axis=1)
    if linear and visual.kind is not None:
        colours = linear_to_srgb(np.clip(colours, 0.0, 1.0))
    uv = np.nan_to_num(uv, nan=0.0, posinf=0.0, neginf=0.0)
    number = np.full(count, -1 if picture is None else 0)
    return Surface(corners, colours, uv, number, () if picture is None else (picture,))


def _material(material: Any, side: int | None) -> tuple[Floats, NDArray[np.float64] | None]:
    """Return a material's plain colour (3,) and its image (height, width, 3), as RGB values from 0 to 1."""
    if isinstance(material, trimesh.visual.material.PBRMaterial):
        factor, picture = material.baseColorFactor, material.baseColorTexture
    else:
        factor, picture = getattr(material, "diffuse", None), getattr(material, "image", None)
    if picture is not None and side is not None:
        picture = picture.copy()
        picture.thumbnail((side, side))
    pixels = None if picture is None else np.asarray(picture.convert("RGB"), np.float64) / 255
    if pixels is not None and getattr(material, "alphaMode", None) in _TRANSLUCENT:
        clear = np.asarray(picture.convert("RGBA"))[..., 3] < 255 * _OPAQUE
        if not clear.all():  # The colour of transparent pixels is arbitrary, and often black.
            pixels[clear] = pixels[~clear].mean(axis=0)
    if factor is None:
        return np.ones(3) if pixels is not None else np.array(PLAIN), pixels
    return np.asarray(factor, np.float64)[:3] / 255, pixels


def is_opaque(mesh: trimesh.Trimesh) -> bool:
    """Return False for a translucent mesh, such as a painted shadow or a pane."""
    visual = mesh.visual
    material: Any = visual.material if visual.kind == "texture" else None
    if getattr(material, "alphaMode", None) not in _TRANSLUCENT:
        return True
    opacity = 1.0 if material.baseColorFactor is None else float(material.baseColorFactor[3]) / 255
    if (picture := material.baseColorTexture) is not None:
        opacity *= float(np.asarray(picture.convert("RGBA"))[..., 3].mean()) / 255
    shades = visual.vertex_attributes.get("color")
    if shades is not None and shades.shape[1] == 4:
        opacity *= float(_unit(shades)[:, 3].mean())
    return opacity >= _OPAQUE


def _unit(values: NDArray[Any]) -> Floats:
    """Convert normalized integers to numbers from 0 to 1."""
    whole = np.iinfo(values.dtype).max if np.issubdtype(values.dtype, np.integer) else 1
    return np.clip(np.nan_to_num(values.astype(np.float64) / whole), 0.0, 1.0)
