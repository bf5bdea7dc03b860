"""Types for defining sensors, and the input that sensors receive."""

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
    """Options for images from the person's eye camera.

    Attributes:
        profile: Render profile, which is `draft`, `fast` or `quality`.
        far: Maximum depth in metres. Larger depths are clipped to this value.

    Raises:
        EnvironmentConfigError: The image size or `far` is not positive.
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
    """The sizes and normalization constants of an environment's observation arrays."""

    slots: int  # number of rows in per-object arrays; row i belongs to object i of the episode
    categories: tuple[str, ...]  # keys of the object categories, in catalogue order
    receptacles: tuple[str, ...]  # keys of the receptacles, in catalogue order
    floor: Footprint  # obstacles and bounds of the floor
    camera: CameraOptions
    max_speed: float  # maximum speed, used to normalize velocities, in m/s
    time_limit: float  # simulated time after which an episode is truncated, in seconds

    @property
    def scale(self) -> float:
        """The diagonal of the floor in metres, which is used to normalize lengths."""
        x_min, y_min, x_max, y_max = self.floor.bounds
        return math.hypot(x_max - x_min, y_max - y_min)

    @cached_property
    def edges(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The start points and vectors of all obstacle edges, in metres, each of shape (edges, 2)."""
        outlines = self.floor.obstacles
        if not outlines:
            return np.empty((0, 2)), np.empty((0, 2))
        return np.vstack(outlines), np.vstack([np.roll(o, -1, axis=0) - o for o in outlines])

    def scaled(self, lengths: NDArray[np.float64]) -> NDArray[np.float32]:
        """Divide lengths in metres by `scale`, and clip the results to [-1, 1]."""
        return np.clip(lengths / self.scale, -1.0, 1.0).astype(np.float32)


@dataclass(frozen=True, eq=False)
class SensorInput:
    """The input of a sensor, which contains the current state of an episode."""

    layout: ObservationLayout
    episode: CompiledEpisode
    state: Observation
    images: frozenset[str]  # image channels that the environment's sensors need

    @property
    def world(self) -> World:
        """The simulated world, which must not be changed."""
        return self.episode.world

    @property
    def start(self) -> StartPose:
        """The person's pose at the start of the episode."""
        return self.world.scene.episode.start

    @cached_property
    def frame(self) -> Frame:
        """The first-person view with the channels in `images`. It is rendered once and shared by all sensors.

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
    """Rotate vectors of shape (..., 2) counter-clockwise by an angle in radians."""
    c, s = np.cos(angle), np.sin(angle)
    return np.asarray(vectors @ np.array([[c, s], [-s, c]]))


@dataclass(frozen=True)
class Sensor:
    """A sensor that computes one array of an observation.

    Attributes:
        name: Key of the sensor's array in the observation.
        declare: Function that returns the spec of the array for a layout. The spec is renamed to `name`.
        read: Function that returns a new array that conforms to the spec.
        images: Channels of `SensorInput.frame` that `read` uses, out of `rgb`, `depth` and `segmentation`.
    """

    name: str
    declare: Callable[[ObservationLayout], specs.Array]
    read: Callable[[SensorInput], NDArray[Any]]
    images: frozenset[str] = field(default_factory=frozenset)

    def spec(self, layout: ObservationLayout) -> specs.Array:
        """Return the specification of the sensor's array."""
        return self.declare(layout).replace(name=self.name)


def unit_spec(*shape: int, low: float = -1.0) -> specs.BoundedArray:
    """Return the spec of a float32 array with values from `low` to 1."""
    return specs.BoundedArray(shape, np.float32, low, 1.0)
