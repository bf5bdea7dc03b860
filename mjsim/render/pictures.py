"""Small pictures of objects and receptacles on a transparent background, for lists and inventories."""

import dataclasses
from pathlib import Path
from typing import Any

import cv2
import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.render.cameras import ViewVolume, look_rotation
from mjsim.render.context import current_context
from mjsim.render.profiles import RenderProfile
from mjsim.render.rasteriser import FIRST_PERSON_GROUPS, Rasteriser
from mjsim.render.scene_settings import DirectionalLight
from mjsim.values.errors import AssetError, RenderError

SUPERSAMPLING = 3
# Share of the picture's side that its subject fills.
FILL = 0.92
# Seen from the front right, where the near side of a receptacle faces -y; flat objects from higher up.
_AZIMUTH = np.deg2rad(28.0)
_ELEVATION = np.deg2rad(32.0)
_ELEVATION_FLAT = np.deg2rad(52.0)
_FLAT = 0.3
# From the upper left of the picture, and weaker ones that keep the shaded sides apart.
_LIGHTS = (
    DirectionalLight((0.75, 0.35, -0.75), diffuse=0.62, ambient=0.42),
    DirectionalLight((-0.7, 0.6, -0.2), diffuse=0.28),
)
_DISTANCE = 5.0
_PROFILE = RenderProfile("picture", skybox=False)


def render_pictures(catalogue: Catalogue, size: int = 96) -> dict[str, NDArray[np.uint8]]:
    """RGBA pictures (size, size, 4), straight alpha, by `object:<key>` and `receptacle:<key>`.

    Raises:
        AssetError: A model file does not compile.
        RenderError: No OpenGL context can be made, the size is unusable, or a model shows nothing.
    """
    files = {f"object:{key}": entry.path for key, entry in catalogue.objects.items()}
    files |= {f"receptacle:{key}": entry.path for key, entry in catalogue.receptacles.items()}
    return {key: render_picture(path, size) for key, path in files.items()}


def render_picture(path: Path, size: int = 96) -> NDArray[np.uint8]:
    """Draw one MJCF file: RGBA (size, size, 4), straight alpha, rows from the top; raises as `render_pictures`."""
    try:
        model = mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        raise AssetError(f"cannot compile {path}: {error}") from error
    return draw_picture(model, size, str(path))


def draw_picture(model: Any, size: int, name: str) -> NDArray[np.uint8]:
    """Draw a compiled model: RGBA (size, size, 4), straight alpha, rows from the top; errors call it `name`."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    if not 1 <= size <= 1024:
        raise RenderError(f"picture sides must be 1 to 1024 pixels, got {size}")
    side = size * SUPERSAMPLING
    with Rasteriser(model, side, side, _PROFILE, lights=_LIGHTS) as rasteriser, current_context():
        rasteriser.update(data)
        view = _framed(rasteriser, _first_view(model, data), name)
        colour, mask = rasteriser.colour(view), rasteriser.geometry(view)[0] >= 0
    return _reduce(colour, mask, size)


def _first_view(model: Any, data: Any) -> ViewVolume:
    """Orthographic view that is sure to hold the whole model."""
    low, high = _bounds(model, data)
    centre, radius = (low + high) / 2, float(np.linalg.norm(high - low)) / 2
    flat = (high - low)[2] < _FLAT * max((high - low)[:2])
    elevation = _ELEVATION_FLAT if flat else _ELEVATION
    level = np.array([np.sin(_AZIMUTH), -np.cos(_AZIMUTH), 0.0]) * np.cos(elevation)
    backward = level + np.array([0.0, 0.0, np.sin(elevation)])
    return ViewVolume(
        position=centre + _DISTANCE * backward,
        rotation=look_rotation(-backward),
        half_height=1.05 * radius,
        near=0.1,
        far=2 * _DISTANCE,
        orthographic=True,
    )


def _bounds(model: Any, data: Any) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Corners of the box around the shown geoms, m, shape (3,) each."""
    shown = np.isin(model.geom_group, FIRST_PERSON_GROUPS)
    if not shown.any():
        raise RenderError("a model without geoms in the groups 0 to 2 has no picture; add visual geoms")
    rotations = data.geom_xmat.reshape(-1, 3, 3)[shown]
    boxes = model.geom_aabb[shown]
    centres = data.geom_xpos[shown] + np.einsum("gij,gj->gi", rotations, boxes[:, :3])
    halves = np.einsum("gij,gj->gi", np.abs(rotations), boxes[:, 3:])
    return (centres - halves).min(axis=0), (centres + halves).max(axis=0)


def _framed(rasteriser: Rasteriser, view: ViewVolume, name: str) -> ViewVolume:
    """The view shifted and scaled so that what is seen fills the picture; twice, the second time finely."""
    for _ in range(2):
        mask = rasteriser.geometry(view)[0] >= 0
        if not mask.any():
            raise RenderError(
                f"{name} shows nothing: give it geoms in the groups 0 to 2 that are not transparent"
            )
        side = len(mask)
        columns, rows = np.flatnonzero(mask.any(axis=0)), np.flatnonzero(mask.any(axis=1))
        right = (columns[0] + columns[-1] + 1) / side - 1.0
        up = 1.0 - (rows[0] + rows[-1] + 1) / side
        extent = max(columns[-1] - columns[0], rows[-1] - rows[0]) + 1
        shift = view.rotation[:, 0] * right + view.rotation[:, 1] * up
        view = dataclasses.replace(
            view,
            position=view.position + shift * view.half_height,
            half_height=view.half_height * extent / side / FILL,
        )
    return view


def _reduce(colour: NDArray[np.uint8], mask: NDArray[np.bool_], size: int) -> NDArray[np.uint8]:
    """Average blocks of pixels, weighting colours by coverage so that no background bleeds into the edges."""
    weight = mask.astype(np.float32)
    covered = cv2.resize(weight, (size, size), interpolation=cv2.INTER_AREA)
    summed = cv2.resize(colour * weight[..., None], (size, size), interpolation=cv2.INTER_AREA)
    mean = summed / np.maximum(covered, 1e-6)[..., None]
    picture = np.concatenate((mean, 255.0 * covered[..., None]), axis=2)
    return np.asarray(np.round(np.clip(picture, 0.0, 255.0)), dtype=np.uint8)
