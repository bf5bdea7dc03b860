"""Pictures of objects and receptacles, and floor plans of houses."""

import copy
import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import mujoco
import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.compiled.footprint import bounding_boxes, outline_points
from mjsim.house.compiled.house import compiled_house
from mjsim.house.scene import avatar
from mjsim.render.cameras import ViewVolume, look_rotation
from mjsim.render.context import current_context
from mjsim.render.profiles import MAX_SIDE, RenderProfile
from mjsim.render.rasteriser import (
    CEILING_GROUP,
    FIRST_PERSON_GROUPS,
    TOP_DOWN_GROUPS,
    Rasteriser,
    reduced,
)
from mjsim.render.scene_settings import DirectionalLight
from mjsim.values.errors import AssetError, RenderError

SUPERSAMPLING = 3
FILL = 0.92  # size of the subject as a fraction of the picture's side
# The camera is to the front right of the subject (receptacles face -y), and higher up if the subject is flat.
_AZIMUTH = np.deg2rad(28.0)
_ELEVATION = np.deg2rad(32.0)
_ELEVATION_FLAT = np.deg2rad(52.0)
_FLAT = 0.3  # ratio of height to width below which an object counts as flat
# The main light comes from the upper left. The weaker one brightens the shaded sides.
_LIGHTS = (
    DirectionalLight((0.75, 0.35, -0.75), diffuse=0.62, ambient=0.42),
    DirectionalLight((-0.7, 0.6, -0.2), diffuse=0.28),
)
_DISTANCE = 5.0
_PROFILE = RenderProfile("picture", skybox=False)
_PAPER = 244  # grey level of a floor plan's background, from 0 to 255
_HEIGHT = 10.0  # height of the camera for floor plans above the floor, in metres
_HEADROOM = 1.8  # minimum height of the lower edge of a lintel, in metres
_STEP = 0.05  # maximum height of rugs and door sills, in metres
_BLOCKED = 0.2  # share of the floor below a geom above which the geom is not over a doorway
_PLAN_LIGHTS = (DirectionalLight((0.25, -0.35, -1.0), diffuse=0.55, ambient=0.5),)
_PLAN_PROFILE = RenderProfile("floorplan", supersampling=2.0, skybox=False)


def render_pictures(catalogue: Catalogue, size: int = 96) -> dict[str, NDArray[np.uint8]]:
    """Draw all objects and receptacles of a catalogue as RGBA images (size, size, 4) with straight alpha.

    The keys are `object:<key>` and `receptacle:<key>`.

    Raises:
        AssetError: A model file does not compile.
        RenderError: No OpenGL context can be created, the size is invalid, or a model has no visible geoms.
    """
    files = {f"object:{key}": entry.path for key, entry in catalogue.objects.items()}
    files |= {f"receptacle:{key}": entry.path for key, entry in catalogue.receptacles.items()}
    return {key: render_picture(path, size) for key, path in files.items()}


def render_picture(path: Path, size: int = 96) -> NDArray[np.uint8]:
    """Draw an MJCF file as an RGBA image of shape (size, size, 4) with straight alpha.

    Raises:
        AssetError: The file does not compile.
        RenderError: No OpenGL context can be created, the size is invalid, or the model has no visible geoms.
    """
    try:
        model = mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        raise AssetError(f"cannot compile {path}: {error}") from error
    return draw_picture(model, size, str(path))


def draw_picture(model: Any, size: int, name: str) -> NDArray[np.uint8]:
    """Draw a compiled model as an RGBA image (size, size, 4) with straight alpha. Errors mention `name`."""
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
    shown = np.isin(model.geom_group, FIRST_PERSON_GROUPS)
    if not shown.any():
        raise RenderError("a model without geoms in the groups 0 to 2 has no picture; add visual geoms")
    lows, highs = bounding_boxes(model, data, shown)
    low, high = lows.min(axis=0), highs.max(axis=0)
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


def _framed(rasteriser: Rasteriser, view: ViewVolume, name: str) -> ViewVolume:
    """Shift and scale the view so that the subject fills the picture. A second pass refines the result."""
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
    """Average blocks of pixels. Colours are weighted by coverage, which keeps the background out of edges."""
    weight = mask.astype(np.float32)
    covered = cv2.resize(weight, (size, size), interpolation=cv2.INTER_AREA)
    summed = cv2.resize(colour * weight[..., None], (size, size), interpolation=cv2.INTER_AREA)
    mean = summed / np.maximum(covered, 1e-6)[..., None]
    picture = np.concatenate((mean, 255.0 * covered[..., None]), axis=2)
    return np.asarray(np.round(np.clip(picture, 0.0, 255.0)), dtype=np.uint8)


@dataclass(frozen=True, eq=False)
class FloorPlan:
    """An orthographic picture of a house from above. North (+y) is at the top."""

    rgb: NDArray[np.uint8]  # colour image, shape (height, width, 3), rows from the top
    bounds: tuple[float, float, float, float]  # drawn area (xmin, ymin, xmax, ymax), in metres
    pixels_per_metre: float

    def to_pixels(self, xy: ArrayLike) -> NDArray[np.float64]:
        """Convert floor points (k, 2) in metres to columns and rows. Pixel centres are half-integers."""
        points = np.asarray(xy, dtype=np.float64)
        corner = np.array([self.bounds[0], self.bounds[3]])
        return np.asarray((points - corner) * [self.pixels_per_metre, -self.pixels_per_metre])


def render_floorplan(
    model: Any,
    data: Any,
    bounds: tuple[float, float, float, float],
    pixels_per_metre: float = 60.0,
) -> FloorPlan:
    """Draw a house from above, without ceilings (geom group 1), lintels and the person.

    `bounds` is the area (xmin, ymin, xmax, ymax) to draw, in metres.
    """
    xmin, ymin, xmax, ymax = bounds
    if not (np.isfinite(bounds).all() and xmin < xmax and ymin < ymax and pixels_per_metre > 0):
        raise RenderError(
            f"a floor plan needs bounds with min < max and a positive scale, got {bounds} m at {pixels_per_metre}/m"
        )
    # Rounding before `ceil` removes floating-point errors: 12.8 m at 60 pixels/m give 768 pixels, not 769.
    width, height = (int(np.ceil(round(s * pixels_per_metre, 6))) for s in (xmax - xmin, ymax - ymin))
    if max(width, height) * _PLAN_PROFILE.supersampling > MAX_SIDE:
        raise RenderError(
            f"a floor plan of {width} x {height} pixels is too large; lower pixels_per_metre={pixels_per_metre}"
        )
    xmax, ymin = xmin + width / pixels_per_metre, ymax - height / pixels_per_metre
    view = ViewVolume(
        position=np.array([(xmin + xmax) / 2, (ymin + ymax) / 2, _HEIGHT]),
        rotation=look_rotation(np.array([0.0, 0.0, -1.0])),
        half_height=(ymax - ymin) / 2,
        near=0.1,
        far=2 * _HEIGHT,
        orthographic=True,
    )
    model = copy.copy(model)
    model.geom_group[_overhead_geoms(model, data)] = CEILING_GROUP
    rasteriser = Rasteriser(model, width, height, _PLAN_PROFILE, TOP_DOWN_GROUPS, _PLAN_LIGHTS)
    with rasteriser, current_context():
        rasteriser.update(data)
        base = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, avatar.BASE)
        person = (model.body_rootid[model.geom_bodyid] == base) & (base >= 0)
        drawn = rasteriser.layer(view, hidden=person, lowest=True)
        rgb = reduced(drawn.colour, rasteriser.size)
        rgb[rasteriser.geometry(view)[0] < 0] = _PAPER
    return FloorPlan(rgb, (xmin, ymin, xmax, ymax), pixels_per_metre)


def _overhead_geoms(model: Any, data: Any) -> NDArray[np.bool_]:
    """Return a mask of the static geoms above head height with free floor below them, such as lintels."""
    static = model.body_weldid[model.geom_bodyid] == 0
    # All types except planes and height fields have an outline.
    has_outline = model.geom_type > int(mujoco.mjtGeom.mjGEOM_HFIELD)
    solid = np.flatnonzero(static & has_outline & np.isin(model.geom_group, TOP_DOWN_GROUPS))
    rotations = data.geom_xmat.reshape(-1, 3, 3)
    points = [outline_points(model, int(g), data.geom_xpos[g], rotations[g]) for g in solid]
    low, high = (np.array([end(p[:, 2]) for p in points]) for end in (np.min, np.max))
    outlines = np.array([shapely.MultiPoint(p[:, :2]).convex_hull for p in points])
    standing = (low < _HEADROOM) & (high > _STEP)
    tree = shapely.STRtree(outlines[standing])
    overhead = np.zeros(model.ngeom, dtype=bool)
    for index in np.flatnonzero(low >= _HEADROOM):
        below = shapely.union_all(tree.geometries[tree.query(outlines[index])])
        blocked = shapely.area(below.intersection(outlines[index]))
        overhead[solid[index]] = blocked <= _BLOCKED * outlines[index].area
    return overhead


def largest_scale(bounds: tuple[float, float, float, float]) -> float:
    """Return the largest scale, in pixels per metre, at which the area `bounds` can be drawn."""
    xmin, ymin, xmax, ymax = bounds
    return (MAX_SIDE / _PLAN_PROFILE.supersampling - 1) / max(xmax - xmin, ymax - ymin)


def render_house_map(
    catalogue: Catalogue, bounds: tuple[float, float, float, float], pixels_per_metre: float = 40.0
) -> NDArray[np.uint8]:
    """Draw a house from above, without any misplaced objects. Return an RGBA image (height, width, 4).

    `bounds` is the area (xmin, ymin, xmax, ymax) to draw, in metres.

    Raises:
        AssetError: The house does not compile.
        RenderError: The bounds are invalid, or no OpenGL context can be created.
    """
    model = compiled_house(catalogue).model
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    rgb = render_floorplan(model, data, bounds, min(pixels_per_metre, largest_scale(bounds))).rgb
    return np.concatenate([rgb, np.full((*rgb.shape[:2], 1), 255, dtype=np.uint8)], axis=2)
