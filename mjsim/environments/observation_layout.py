"""What stays the same in all episodes of an environment, and fixes shapes and scales of its observations."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mjsim.house.compiled.footprint import Footprint
from mjsim.values.errors import EnvironmentConfigError


@dataclass(frozen=True)
class CameraOptions:
    """Images of the eye camera.

    Attributes:
        width: Image width, px.
        height: Image height, px.
        profile: Render profile: `draft`, `fast` or `quality`.
        far: Larger depths are clipped to this, m.

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

    slots: int  # rows of the arrays with a row per object; object i of the episode is in row i
    categories: tuple[str, ...]  # category keys, in the catalogue's order
    receptacles: tuple[str, ...]  # receptacle keys, in the catalogue's order
    floor: Footprint  # obstacles and bounds of the floor
    camera: CameraOptions  # images of the eye camera
    max_speed: float  # velocities are given as a share of this, m/s
    time_limit: float  # simulated time after which an episode is truncated, s

    @property
    def scale(self) -> float:
        """Diagonal of the floor's bounds, m; offsets within the house are given as a share of it."""
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
        """Lengths, m, as shares of `scale`, clipped to [-1, 1]; any shape."""
        return np.clip(lengths / self.scale, -1.0, 1.0).astype(np.float32)
