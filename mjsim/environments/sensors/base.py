"""What a sensor is: a declared array, and how to read it at one moment."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from dm_env import specs
from numpy.typing import NDArray

from mjsim.environments.layout import Layout
from mjsim.episode import StartPose
from mjsim.observation import Observation
from mjsim.render import Frame, Labels
from mjsim.world import World

IMAGES = ("rgb", "depth", "segmentation")


@dataclass(frozen=True, eq=False)
class Moment:
    """One moment of a running episode, for sensors to read.

    Attributes:
        layout: Sizes and scales.
        world: The running episode; read only.
        observation: Live poses.
        frame: Draws what the eye sees, all that the environment's sensors need at once; drawn on first use and
            kept for the moment.
        labels: What the geoms of the episode belong to.
    """

    layout: Layout
    world: World
    observation: Observation
    frame: Callable[[], Frame]
    labels: Callable[[], Labels]

    @property
    def start(self) -> StartPose:
        """Where the person stood at the beginning."""
        return self.world.scene.episode.start

    def to_body(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Floor points (k, 2) of the house in the body frame: forward, left; m."""
        return rotated(points - self.observation.position, -self.observation.heading)


def rotated(vectors: NDArray[np.float64], angle: float) -> NDArray[np.float64]:
    """Vectors (..., 2) turned counter-clockwise by an angle, rad."""
    c, s = np.cos(angle), np.sin(angle)
    return np.asarray(vectors @ np.array([[c, s], [-s, c]]))


@dataclass(frozen=True)
class Sensor:
    """One array of an observation.

    Attributes:
        name: Its key in the observation.
        declare: Layout -> spec; its name is replaced by the sensor's.
        read: Moment -> a fresh array that conforms to the spec.
        images: Which of `rgb`, `depth` and `segmentation` it takes from the moment's frame.
    """

    name: str
    declare: Callable[[Layout], specs.Array]
    read: Callable[[Moment], NDArray[Any]]
    images: frozenset[str] = field(default_factory=frozenset)

    def spec(self, layout: Layout) -> specs.Array:
        """What `read` returns in an environment of this layout."""
        return self.declare(layout).replace(name=self.name)


def unit_spec(*shape: int, low: float = -1.0) -> specs.BoundedArray:
    """A float32 array with values from `low` to 1."""
    return specs.BoundedArray(shape, np.float32, low, 1.0)
