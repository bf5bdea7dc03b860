"""What no episode of an environment changes: what sensors size and scale their arrays by."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mjsim.environments.errors import EnvironmentConfigError
from mjsim.environments.navigable import NavigableBuilder, installed_builder
from mjsim.model.catalogue import Catalogue
from mjsim.model.footprint import Footprint, footprint
from mjsim.model.sampling import NavigablePoints
from mjsim.model.scene import compile_house


@dataclass(frozen=True)
class CameraOptions:
    """The eye camera's images.

    Attributes:
        width: px.
        height: px.
        profile: Render profile.
        far: Depth beyond which everything counts as this far, m.
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
class Layout:
    """Sizes and scales of an environment's arrays.

    Attributes:
        slots: Objects that an observation has room for; object i of the episode has slot i.
        categories: Category keys, in the catalogue's order.
        receptacles: Receptacle keys, in the catalogue's order.
        floor: Obstacles and bounds of the floor.
        camera: The eye camera's images.
        max_speed: Velocities are given as a share of this, m/s.
        time_limit: Simulated time after which an episode is cut off, s.
    """

    slots: int
    categories: tuple[str, ...]
    receptacles: tuple[str, ...]
    floor: Footprint
    camera: CameraOptions
    max_speed: float
    time_limit: float

    @property
    def scale(self) -> float:
        """The floor's diagonal, m: offsets within the house are given as a share of it."""
        x_min, y_min, x_max, y_max = self.floor.bounds
        return math.hypot(x_max - x_min, y_max - y_min)

    @cached_property
    def edges(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Start points and vectors of all the obstacles' edges, m, each (m, 2)."""
        outlines = self.floor.obstacles
        if not outlines:
            return np.empty((0, 2)), np.empty((0, 2))
        return np.vstack(outlines), np.vstack([np.roll(o, -1, axis=0) - o for o in outlines])

    def scaled(self, metres: NDArray[np.float64]) -> NDArray[np.float32]:
        """Lengths as shares of `scale`, clipped to [-1, 1]."""
        return np.clip(metres / self.scale, -1.0, 1.0).astype(np.float32)


@dataclass(frozen=True, eq=False)
class HouseKit:
    """A house made ready once for many episodes.

    Attributes:
        catalogue: What it offers.
        floor: Obstacles and bounds of the floor.
        navigable: Where one can walk, or None for an environment that never samples.
    """

    catalogue: Catalogue
    floor: Footprint
    navigable: NavigablePoints | None

    @classmethod
    def load(
        cls, house: str, *, sampling: bool = True, builder: NavigableBuilder | None = None
    ) -> "HouseKit":
        """Read and compile a house.

        Args:
            house: Name under `models/houses`, or the path of a `catalogue.toml`.
            sampling: Whether episodes will be sampled in it.
            builder: Works out where one can walk; None for the installed one.

        Raises:
            AssetError: The house is malformed.
            EnvironmentConfigError: No builder is installed.
        """
        catalogue = Catalogue.load(house)
        floor = footprint(compile_house(catalogue))
        if not sampling:
            return cls(catalogue, floor, None)
        return cls(catalogue, floor, (builder or installed_builder())(floor.obstacles, floor.bounds))
