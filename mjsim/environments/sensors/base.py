"""The base of sensors: the spec of an array, and the function that reads it."""

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
    """Images of the eye camera.

    Attributes:
        profile: Render profile: `draft`, `fast` or `quality`.
        far: Distance to which depths are clipped, m.

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

    slots: int  # number of rows of arrays with a row per object; object i of the episode is in row i
    categories: tuple[str, ...]  # category keys, in the catalogue's order
    receptacles: tuple[str, ...]  # receptacle keys, in the catalogue's order
    floor: Footprint  # obstacles and bounds of the floor
    camera: CameraOptions
    max_speed: float  # unit of velocities, m/s
    time_limit: float  # simulated time after which an episode is truncated, s

    @property
    def scale(self) -> float:
        """Unit of lengths: the diagonal of the floor's bounds, m."""
        x_min, y_min, x_max, y_max = self.floor.bounds
        return math.hypot(x_max - x_min, y_max - y_min)

    @cached_property
    def edges(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Start points and vectors of the edges of all obstacles, m, each of shape (edges, 2)."""
        outlines = self.floor.obstacles
        if not outlines:
            return np.empty((0, 2)), np.empty((0, 2))
        return np.vstack(outlines), np.vstack([np.roll(o, -1, axis=0) - o for o in outlines])

    def scaled(self, lengths: NDArray[np.float64]) -> NDArray[np.float32]:
        """Convert lengths, m, of any shape to shares of `scale`, clipped to [-1, 1]."""
        return np.clip(lengths / self.scale, -1.0, 1.0).astype(np.float32)


@dataclass(frozen=True, eq=False)
class SensorInput:
    """Input of sensors: one control step of an episode."""

    layout: ObservationLayout
    episode: CompiledEpisode
    state: Observation
    images: frozenset[str]  # channels of `frame` that the environment's sensors need

    @property
    def world(self) -> World:
        """The simulation, which must not be changed."""
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
        """Transform floor points of the house (k, 2), m, to the body frame (forward, left), m, (k, 2)."""
        return rotated(points - self.state.position, -self.state.heading)


def rotated(vectors: NDArray[np.float64], angle: float) -> NDArray[np.float64]:
    """Rotate vectors (..., 2) counter-clockwise by an angle, rad."""
    c, s = np.cos(angle), np.sin(angle)
    return np.asarray(vectors @ np.array([[c, s], [-s, c]]))


@dataclass(frozen=True)
class Sensor:
    """One array of an observation.

    Attributes:
        name: Key of the array in the observation.
        declare: Function from a layout to the spec of the array. The name of the spec is replaced.
        read: Function from an input to a new array that conforms to the spec.
        images: Channels of `SensorInput.frame` that it reads: `rgb`, `depth`, `segmentation`.
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
