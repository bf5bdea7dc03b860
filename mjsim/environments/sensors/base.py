"""Sensors, each with the spec of its array and a function that computes the array."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from dm_env import specs
from numpy.typing import NDArray

from mjsim.environments.episodes import CompiledEpisode
from mjsim.house.compiled.footprint import Footprint
from mjsim.render import Frame
from mjsim.values.episode import StartPose
from mjsim.values.errors import EnvironmentConfigError
from mjsim.values.observation import Observation
from mjsim.world.world import World

IMAGES = ("rgb", "depth", "segmentation")


@dataclass(frozen=True)
class CameraOptions:
    """Options of the eye camera's images.

    Attributes:
        profile: Render profile: `draft`, `fast` or `quality`.
        far: Distance to which depths are clipped, in metres.

    Raises:
        EnvironmentConfigError: A size or `far` is not positive.
    """

    width: int = 128
    height: int = 96
    profile: str = "fast"
    far: float = 20.0

    def __post_init__(self) -> None:
        if self.width < 1 or self.height < 1:
            raise EnvironmentConfigError(
                f"an image needs at least one pixel, got {self.width} x {self.height}"
            )
        if not (math.isfinite(self.far) and self.far > 0):
            raise EnvironmentConfigError(f"far must be a positive number of metres, got {self.far}")


@dataclass(frozen=True, eq=False)
class ObservationLayout:
    """Sizes and scales of an environment's observation arrays."""

    slots: int  # number of rows in arrays with one row per object; row i belongs to object i of the episode
    categories: tuple[str, ...]  # category keys, in the catalogue's order
    receptacles: tuple[str, ...]  # receptacle keys, in the catalogue's order
    floor: Footprint  # obstacles and bounds of the floor
    camera: CameraOptions
    max_speed: float  # speed by which velocities are divided, in m/s
    time_limit: float  # simulated time after which an episode is truncated, in seconds

    @property
    def scale(self) -> float:
        """Diagonal of the floor's bounds in metres, by which lengths are divided."""
        x_min, y_min, x_max, y_max = self.floor.bounds
        return math.hypot(x_max - x_min, y_max - y_min)

    @cached_property
    def edges(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Start points and vectors of the edges of all obstacles, in metres, each of shape (edges, 2)."""
        outlines = self.floor.obstacles
        if not outlines:
            return np.empty((0, 2)), np.empty((0, 2))
        return np.vstack(outlines), np.vstack([np.roll(o, -1, axis=0) - o for o in outlines])

    def scaled(self, lengths: NDArray[np.float64]) -> NDArray[np.float32]:
        """Divide lengths in metres by `scale`, and clip the results to [-1, 1]."""
        return np.clip(lengths / self.scale, -1.0, 1.0).astype(np.float32)


@dataclass(frozen=True, eq=False)
class SensorInput:
    """Input of sensors: the current state of an episode."""

    layout: ObservationLayout
    episode: CompiledEpisode
    state: Observation
    images: frozenset[str]  # channels of `frame` that the environment's sensors need

    @property
    def world(self) -> World:
        """The simulated world, which must not be changed."""
        return self.episode.world

    @property
    def start(self) -> StartPose:
        return self.world.scene.episode.start

    @cached_property
    def frame(self) -> Frame:
        """The first-person view with the channels in `images`, rendered at first use for all sensors.

        Raises:
            RenderError: No OpenGL context can be created.
        """
        camera = self.layout.camera
        renderer = self.episode.renderer(camera.width, camera.height, camera.profile)
        rgb, depth, segmentation = (channel in self.images for channel in IMAGES)
        return renderer.frame(self.world.data, rgb=rgb, depth=depth, segmentation=segmentation)

    def to_body(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Transform floor points (k, 2) from the house frame to the body frame (forward, left), in metres."""
        return rotated(points - self.state.position, -self.state.heading)


def rotated(vectors: NDArray[np.float64], angle: float) -> NDArray[np.float64]:
    """Rotate vectors, shape (..., 2), counter-clockwise by an angle in radians."""
    c, s = np.cos(angle), np.sin(angle)
    return np.asarray(vectors @ np.array([[c, s], [-s, c]]))


@dataclass(frozen=True)
class Sensor:
    """One array of an observation.

    Attributes:
        name: Key of the array in the observation.
        declare: Function that returns the array's spec for a layout. `name` replaces the name of the spec.
        read: Function that computes a new array, which conforms to the spec.
        images: Channels of `SensorInput.frame` that `read` uses: `rgb`, `depth`, `segmentation`.
    """

    name: str
    declare: Callable[[ObservationLayout], specs.Array]
    read: Callable[[SensorInput], NDArray[Any]]
    images: frozenset[str] = field(default_factory=frozenset)

    def spec(self, layout: ObservationLayout) -> specs.Array:
        return self.declare(layout).replace(name=self.name)


def unit_spec(*shape: int, low: float = -1.0) -> specs.BoundedArray:
    """Return the spec of a float32 array with values from `low` to 1."""
    return specs.BoundedArray(shape, np.float32, low, 1.0)
