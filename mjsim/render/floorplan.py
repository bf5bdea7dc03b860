"""A picture of the house from straight above, with an exact scale."""

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.compiled.house import compiled_house
from mjsim.house.scene import avatar
from mjsim.render.cameras import ViewVolume, look_rotation
from mjsim.render.context import current_context
from mjsim.render.profiles import MAX_SIDE, RenderProfile
from mjsim.render.rasteriser import TOP_DOWN_GROUPS, Rasteriser
from mjsim.render.scene_settings import DirectionalLight
from mjsim.values.errors import RenderError

_PAPER = 244  # grey level where there is no house
# Above any house of one storey.
_HEIGHT = 10.0
_LIGHTS = (DirectionalLight((0.25, -0.35, -1.0), diffuse=0.55, ambient=0.5),)
_PROFILE = RenderProfile("floorplan", supersampling=2.0, skybox=False)


@dataclass(frozen=True, eq=False)
class FloorPlan:
    """An orthographic picture; north (+y) is up."""

    rgb: NDArray[np.uint8]  # picture, uint8, shape (height, width, 3), rows from the top
    bounds: tuple[float, float, float, float]  # xmin, ymin, xmax, ymax, m
    pixels_per_metre: float

    def to_pixels(self, xy: ArrayLike) -> NDArray[np.float64]:
        """Points in the house (k, 2), m, as columns and rows (k, 2); centres of pixels are half a pixel in."""
        points = np.asarray(xy, dtype=np.float64)
        corner = np.array([self.bounds[0], self.bounds[3]])
        return np.asarray((points - corner) * [self.pixels_per_metre, -self.pixels_per_metre])


def render_floorplan(
    model: Any,
    data: Any,
    bounds: tuple[float, float, float, float],
    pixels_per_metre: float = 60.0,
) -> FloorPlan:
    """Draw the house from above, without ceilings (geom group 1) and person, within (xmin, ymin, xmax, ymax), m."""
    xmin, ymin, xmax, ymax = bounds
    if not (np.isfinite(bounds).all() and xmin < xmax and ymin < ymax and pixels_per_metre > 0):
        raise RenderError(
            f"a floor plan needs bounds with min < max and a positive scale, got {bounds} m at {pixels_per_metre}/m"
        )
    # Rounding first keeps 12.8 m at 60/m at 768 pixels despite binary fractions.
    width, height = (int(np.ceil(round(s * pixels_per_metre, 6))) for s in (xmax - xmin, ymax - ymin))
    if max(width, height) * _PROFILE.supersampling > MAX_SIDE:
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
    rasteriser = Rasteriser(model, width, height, _PROFILE, TOP_DOWN_GROUPS, _LIGHTS)
    with rasteriser, current_context():
        rasteriser.update(data)
        drawn = rasteriser.layer(view, hidden=_of_person(model), lowest=True)
        rgb = rasteriser.reduced(drawn.colour)
        rgb[rasteriser.geometry(view)[0] < 0] = _PAPER
    return FloorPlan(rgb, (xmin, ymin, xmax, ymax), pixels_per_metre)


def _of_person(model: Any) -> NDArray[np.bool_]:
    """Geoms of the person, shape (ngeom,); a model without a person has none."""
    base = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, avatar.BASE)
    return np.asarray((model.body_rootid[model.geom_bodyid] == base) & (base >= 0))


def largest_scale(bounds: tuple[float, float, float, float]) -> float:
    """The largest scale at which bounds (xmin, ymin, xmax, ymax, m) can be drawn, pixels per metre."""
    xmin, ymin, xmax, ymax = bounds
    return (MAX_SIDE / _PROFILE.supersampling - 1) / max(xmax - xmin, ymax - ymin)


def render_house_map(
    catalogue: Catalogue, bounds: tuple[float, float, float, float], pixels_per_metre: float = 40.0
) -> NDArray[np.uint8]:
    """The tidy house from above within (xmin, ymin, xmax, ymax), m, as RGBA, uint8, (height, width, 4).

    Raises:
        AssetError: The house does not compile.
        RenderError: As for `render_floorplan`.
    """
    model = compiled_house(catalogue).model
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    rgb = render_floorplan(model, data, bounds, min(pixels_per_metre, largest_scale(bounds))).rgb
    return np.concatenate([rgb, np.full((*rgb.shape[:2], 1), 255, dtype=np.uint8)], axis=2)
