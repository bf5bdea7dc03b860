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
from mjsim.environments.sensors.vector_kernels import (
    EpisodeConstants,
    ObservedState,
    ObstacleEdges,
    compute_vectors,
    vector_shapes,
)
from mjsim.house.compiled.footprint import Footprint
from mjsim.house.scene.scene import Scene
from mjsim.render import Frame
from mjsim.support.kernels import specialized
from mjsim.values.episode import StartPose
from mjsim.values.errors import EnvironmentConfigError
from mjsim.values.observation import ObjectStatus, Observation
from mjsim.world.world import World

_STATUSES = tuple(ObjectStatus)
_MARGIN = 1e-6  # tolerance for rounding errors, in metres
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
    def vectors(self) -> "np.dtype[np.void]":
        """The record type that contains the arrays of all vector sensors, by name."""
        shapes = vector_shapes(self.slots, len(self.categories), len(self.receptacles))
        return np.dtype([(name, np.float32, shape) for name, shape in shapes.items()])

    @cached_property
    def obstacles(self) -> ObstacleEdges:
        outlines = self.floor.obstacles
        sides = [np.hstack([outline, np.roll(outline, -1, axis=0) - outline]) for outline in outlines]
        return ObstacleEdges(
            edges=np.vstack([np.zeros((0, 4)), *sides]),
            first=np.cumsum([0, *map(len, outlines)]),
            circles=np.array([_circle_around(outline) for outline in outlines]).reshape(-1, 3),
        )

    def vectors_of(self, scene: Scene) -> Callable[[Observation], NDArray[np.void]]:
        """Return a function that computes the arrays of all vector sensors from a state of an episode."""
        episode, blank = scene.episode, np.zeros((), self.vectors)
        for i, placed in enumerate(episode.objects):
            blank["object_mask"][i] = 1.0
            blank["object_categories"][i, self.categories.index(placed.category)] = 1.0
        centers = {key: receptacle.center[:2] for key, receptacle in scene.receptacles.items()}
        constants = EpisodeConstants(
            offsets=np.array([field[1] // 4 for field in (self.vectors.fields or {}).values()]),
            start=np.array([episode.start.x, episode.start.y, episode.start.heading]),
            bounds=np.array(self.floor.bounds),
            receptacles=np.array([centers[key] for key in self.receptacles]).reshape(-1, 2),
            bins=np.array([centers[episode.targets[name]] for name in scene.index.names]),
            obstacles=self.obstacles,
            scale=self.scale,
            max_speed=float(self.max_speed),
            time_limit=float(self.time_limit),
        )
        constant_vectors = np.ndarray(blank.nbytes // 4, np.float32, blank)
        compute = specialized(compute_vectors, ObservedState.example(), constants, constant_vectors)

        def vectors(state: Observation) -> NDArray[np.void]:
            names, (left, right), values = state.object_names, state.hands, constant_vectors.copy()
            hands = -1 if left is None else names.index(left), -1 if right is None else names.index(right)
            statuses = np.array([_STATUSES.index(status) for status in state.object_status])
            snapshot = ObservedState(
                state.time, state.position, state.heading, state.pitch, state.velocity, hands, state.busy,
                state.object_positions, state.object_quaternions, statuses,
            )  # fmt: skip
            compute(snapshot, constants, values)
            return np.ndarray((), self.vectors, values)

        return vectors


def _circle_around(outline: NDArray[np.float64]) -> list[float]:
    center = (outline.min(axis=0) + outline.max(axis=0)) / 2
    return [*center, np.linalg.norm(outline - center, axis=1).max() + _MARGIN]


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

    @cached_property
    def vectors(self) -> NDArray[np.void]:
        """The arrays of all vector sensors by name. They are computed once and shared by all sensors."""
        scene = self.world.scene
        return scene.cached("vectors", lambda: self.layout.vectors_of(scene))(self.state)

    def to_body(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Transform floor points (k, 2) from the house frame to the body frame (forward, left), in metres."""
        c, s = math.cos(self.state.heading), math.sin(self.state.heading)
        return np.asarray((points - self.state.position) @ np.array([[c, -s], [s, c]]))


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
