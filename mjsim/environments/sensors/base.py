"""A sensor: the spec of an array, and the function that reads it."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from dm_env import specs
from numpy.typing import NDArray

from mjsim.environments.episodes import CompiledEpisode
from mjsim.environments.observation_layout import ObservationLayout
from mjsim.render import Frame
from mjsim.values.episode import StartPose
from mjsim.values.observation import Observation
from mjsim.world.world import World

IMAGES = ("rgb", "depth", "segmentation")


@dataclass(frozen=True, eq=False)
class SensorInput:
    """What sensors read: one control step of an episode.

    Attributes:
        layout: Sizes and scales of the arrays.
        episode: The compiled episode.
        state: The full state of the task.
        images: Channels of `frame` that the sensors of the environment need.
    """

    layout: ObservationLayout
    episode: CompiledEpisode
    state: Observation
    images: frozenset[str]

    @property
    def world(self) -> World:
        """The simulation; treat it as read-only."""
        return self.episode.world

    @property
    def start(self) -> StartPose:
        """Pose of the person at the start of the episode."""
        return self.world.scene.episode.start

    @cached_property
    def frame(self) -> Frame:
        """The first-person view, with all the channels in `images`; rendered on first use, once for all sensors.

        Raises:
            RenderError: No OpenGL context could be made.
        """
        camera = self.layout.camera
        renderer = self.episode.renderer(camera.width, camera.height, camera.profile)
        rgb, depth, segmentation = (channel in self.images for channel in IMAGES)
        return renderer.frame(self.world.data, rgb=rgb, depth=depth, segmentation=segmentation)

    def to_body(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Floor points of the house in the body frame (forward, left), m, both of shape (k, 2)."""
        return rotated(points - self.state.position, -self.state.heading)


def rotated(vectors: NDArray[np.float64], angle: float) -> NDArray[np.float64]:
    """Vectors of shape (..., 2) turned counter-clockwise by an angle, rad."""
    c, s = np.cos(angle), np.sin(angle)
    return np.asarray(vectors @ np.array([[c, s], [-s, c]]))


@dataclass(frozen=True)
class Sensor:
    """One array of an observation.

    Attributes:
        name: Key of the array in the observation.
        declare: Layout -> spec of the array; the name of the spec is replaced.
        read: Input -> a new array that conforms to the spec.
        images: The channels of `SensorInput.frame` that it reads: `rgb`, `depth`, `segmentation`.
    """

    name: str
    declare: Callable[[ObservationLayout], specs.Array]
    read: Callable[[SensorInput], NDArray[Any]]
    images: frozenset[str] = field(default_factory=frozenset)

    def spec(self, layout: ObservationLayout) -> specs.Array:
        """Spec of the array in an environment with this layout."""
        return self.declare(layout).replace(name=self.name)


def unit_spec(*shape: int, low: float = -1.0) -> specs.BoundedArray:
    """Spec of a float32 array with values from `low` to 1."""
    return specs.BoundedArray(shape, np.float32, low, 1.0)
