"""Extract the surfaces and lights of a scene, as drawn in the `fast` render profile."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import mujoco
import numpy as np

from mjsim.formats.gltf.cube_maps import laid_out
from mjsim.formats.gltf.shapes import MESHES, Floats, Indices, Shape, shape_of
from mjsim.render.profiles import FAST
from mjsim.render.rasteriser import FIRST_PERSON_GROUPS, TOP_DOWN_GROUPS
from mjsim.render.scene_settings import visual_option
from mjsim.values.errors import AssetError

_OPAQUE_FROM = 0.995  # minimum alpha of geoms that MuJoCo draws as opaque
_RGB = mujoco.mjtTextureRole.mjTEXROLE_RGB
_MAX_LIGHTS = 8  # OpenGL's maximum number of lights, including the headlight
_AMBIENT_ALONE = 0.3  # intensity of ambient light in a scene without lights
_COLOURS = ("ambient", "diffuse", "specular")
_LIGHTS = {mujoco.mjtLightType.mjLIGHT_SPOT: "spot", mujoco.mjtLightType.mjLIGHT_DIRECTIONAL: "directional"}


@dataclass(frozen=True, eq=False)
class GeomSurface:
    """The visible surface of one geom, in the frame of the house.

    Attributes:
        geom: MuJoCo id of the geom.
        positions: Vertices in metres, shape (n, 3).
        normals: Unit normals, shape (n, 3).
        triangles: Vertex indices in counter-clockwise order seen from outside, shape (t, 3).
        uv: Texture coordinates with v pointing down, shape (n, 2), or None without a texture.
        texture: MuJoCo id of the texture, or -1 without a texture.
        rgba: RGBA colour from 0 to 1, shape (4,).
        shine: Specular, shininess and emission values from 0 to 1, shape (3,).
        is_decal: True for a translucent plane, such as a contact shadow. MuJoCo draws decals before other
            translucent geoms.
        is_ceiling: True if the geom is omitted in top-down views.
    """

    geom: int
    positions: Floats
    normals: Floats
    triangles: Indices
    uv: Floats | None
    texture: int
    rgba: Floats
    shine: Floats
    is_translucent: bool
    is_decal: bool
    is_ceiling: bool

    def within(self, position: Floats, rotation: Floats) -> "GeomSurface":
        """Transform the surface to the frame of a body with the given position and rotation matrix."""
        positions = (self.positions - position) @ rotation
        return replace(self, positions=positions, normals=self.normals @ rotation)


def drawn_scene(model: Any, data: Any) -> Any:
    """Return a MuJoCo scene (`MjvScene`) with everything that a first-person view can show."""
    scene = mujoco.MjvScene(model, maxgeom=model.ngeom + 100)
    option = visual_option(FIRST_PERSON_GROUPS, FAST)
    mujoco.mjv_updateScene(model, data, option, None, mujoco.MjvCamera(), mujoco.mjtCatBit.mjCAT_ALL, scene)
    return scene


def surfaces(model: Any, data: Any, scene: Any) -> Iterator[GeomSurface]:
    """Yield the surfaces of the visible geoms in a MuJoCo scene, in scene order.

    Raises:
        AssetError: A geom has a type that cannot be exported.
    """
    for geom in scene.geoms[: scene.ngeom]:
        if geom.objtype == mujoco.mjtObj.mjOBJ_GEOM and geom.rgba[3] > 0.0:
            yield _surface(model, data, geom)


def _surface(model: Any, data: Any, geom: Any) -> GeomSurface:
    try:
        shape = shape_of(model, geom)
    except ValueError:
        name = model.geom(geom.objid).name
        kind = mujoco.mjtGeom(geom.type).name.removeprefix("mjGEOM_").lower()
        raise AssetError(
            f"geom {name!r} is of the type {kind}, which cannot be exported; make it a mesh"
        ) from None
    is_translucent = bool(geom.rgba[3] < _OPAQUE_FROM)
    # Take poses from the data, because the MuJoCo scene moves infinite planes along with its camera.
    position, rotation = data.geom_xpos[geom.objid], data.geom_xmat[geom.objid].reshape(3, 3)
    shape, texture = _textured(model, geom, shape)
    return GeomSurface(
        geom=int(geom.objid),
        positions=shape.positions @ rotation.T + position,
        normals=shape.normals @ rotation.T,
        triangles=shape.triangles,
        uv=shape.uv if texture >= 0 else None,
        texture=texture,
        rgba=np.clip(np.array(geom.rgba, np.float64), 0.0, 1.0),
        shine=np.clip(np.array([geom.specular, geom.shininess, geom.emission], np.float64), 0.0, 1.0),
        is_translucent=is_translucent,
        is_decal=is_translucent and geom.type == mujoco.mjtGeom.mjGEOM_PLANE,
        is_ceiling=model.geom_group[geom.objid] not in TOP_DOWN_GROUPS,
    )


def _textured(model: Any, geom: Any, shape: Shape) -> tuple[Shape, int]:
    texture = int(model.mat_texid[geom.matid, _RGB]) if geom.matid >= 0 else -1
    if texture < 0:
        return shape, -1
    is_cube = model.tex_type[texture] != mujoco.mjtTexture.mjTEXTURE_2D
    size = np.array(geom.size, np.float64)
    scale = np.where(size > 0.0, size, 1.0) if model.mat_texuniform[geom.matid] else np.ones(3)
    repeat = scale[:2] * model.mat_texrepeat[geom.matid]
    if not is_cube:
        if shape.uv is not None:
            is_endless = geom.type == mujoco.mjtGeom.mjGEOM_PLANE and size[:2].min() <= 0.0
            return shape._replace(uv=shape.uv * repeat - 0.5 * is_endless), texture
        over = shape.unscaled[:, :2] / size[:2] * [0.5, -0.5]  # projects the texture along the mesh's z axis
        return shape._replace(uv=over * repeat + 0.5), texture
    if shape.uv is not None and geom.type in MESHES:
        return shape, -1  # MuJoCo ignores cube textures on meshes with texture coordinates
    width = int(model.tex_width[texture])
    return laid_out(shape, scale, width, int(model.tex_height[texture]) // width), texture


def lights_of(scene: Any) -> dict[str, Any]:
    """Describe the headlight and the other lights of a MuJoCo scene as JSON values.

    Positions are in metres in the frame of the house, and cutoffs are in degrees. Lights of type `point` and
    `image` are omitted, because MuJoCo does not draw them.
    """
    drawn = scene.lights[: min(scene.nlight, _MAX_LIGHTS)]
    headlight = next((_colours(light) for light in drawn if light.headlight), None)
    lights = [
        {
            "type": _LIGHTS[mujoco.mjtLightType(light.type)],
            "position": rounded(light.pos),
            "direction": rounded(light.dir),
            "cutoff": float(light.cutoff),
            "exponent": float(light.exponent),
            "attenuation": rounded(light.attenuation),
            **_colours(light),
        }
        for light in drawn
        if not light.headlight and mujoco.mjtLightType(light.type) in _LIGHTS
    ]
    if headlight is None:
        ambient = 0.0 if lights else _AMBIENT_ALONE
        headlight = {"ambient": [ambient] * 3, "diffuse": [0.0] * 3, "specular": [0.0] * 3}
    return {"lights": lights, "headlight": headlight}


def rounded(values: Any) -> list[float]:
    """Round values to six decimals."""
    return [round(float(value), 6) for value in values]


def _colours(light: Any) -> dict[str, list[float]]:
    return {name: rounded(getattr(light, name)) for name in _COLOURS}
