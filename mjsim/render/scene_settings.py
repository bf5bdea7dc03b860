"""Settings of MuJoCo's renderer: visible geoms, lights, effects and buffer sizes."""

from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from mjsim.render.profiles import MAX_SIDE, RenderProfile
from mjsim.values.errors import RenderError

_Flag = mujoco.mjtRndFlag


@dataclass(frozen=True)
class DirectionalLight:
    """A directional light that replaces the lights of a model."""

    direction: tuple[float, float, float]  # direction of the light rays, a vector of any length
    diffuse: float  # intensity of the light on a surface perpendicular to the rays
    ambient: float = 0.0  # intensity of the light on all surfaces


def checked_size(pixels: int) -> int:
    """Return `pixels` as an int. Raise a RenderError if it is not an integer from 1 to `MAX_SIDE`."""
    if not isinstance(pixels, int | np.integer) or not 1 <= pixels <= MAX_SIDE:
        raise RenderError(f"frame sides must be integers from 1 to {MAX_SIDE} pixels, got {pixels!r}")
    return int(pixels)


def visual_option(groups: Collection[int], profile: RenderProfile) -> Any:
    option = mujoco.MjvOption()
    option.flags[:] = 0
    option.flags[mujoco.mjtVisFlag.mjVIS_STATIC] = 1
    option.flags[mujoco.mjtVisFlag.mjVIS_SKIN] = 1
    option.flags[mujoco.mjtVisFlag.mjVIS_TEXTURE] = profile.textures
    option.geomgroup[:] = [group in groups for group in range(len(option.geomgroup))]
    option.sitegroup[:] = 0
    return option


@contextmanager
def buffer_settings(model: Any, size: tuple[int, int], samples: int, shadow_size: int) -> Iterator[None]:
    """Set the buffer sizes that a new MuJoCo context reads from the model, and restore them afterwards."""
    general, quality = model.vis.global_, model.vis.quality
    kept = general.offwidth, general.offheight, quality.offsamples, quality.shadowsize
    general.offwidth, general.offheight = size
    quality.offsamples, quality.shadowsize = samples, shadow_size
    try:
        yield
    finally:
        general.offwidth, general.offheight, quality.offsamples, quality.shadowsize = kept


def set_flags(scene: Any, profile: RenderProfile) -> None:
    scene.flags[:] = 0
    scene.flags[_Flag.mjRND_CULL_FACE] = 1
    scene.flags[_Flag.mjRND_SHADOW] = profile.shadow_size > 0
    scene.flags[_Flag.mjRND_REFLECTION] = profile.reflections
    scene.flags[_Flag.mjRND_SKYBOX] = profile.skybox


def set_lights(scene: Any, lights: Sequence[DirectionalLight]) -> None:
    scene.nlight = len(lights)
    for target, light in zip(scene.lights, lights, strict=False):
        direction = np.array(light.direction, dtype=np.float64)
        target.headlight = 0
        target.type = mujoco.mjtLightType.mjLIGHT_DIRECTIONAL
        target.pos, target.dir = np.zeros(3), direction / np.linalg.norm(direction)
        target.attenuation = (1.0, 0.0, 0.0)
        target.ambient, target.diffuse = (light.ambient,) * 3, (light.diffuse,) * 3
        target.specular = (0.0,) * 3
        target.castshadow = 0
