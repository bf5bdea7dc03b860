"""The navigable floor of a house, from the installed package that computes one.

Sampling a house needs to know where one can walk. The navmesh belongs to the planner, which mjsim must not import.
So mjsim defines a protocol and loads the entry point `mjsim.navigable`, where this project registers the planner's.
"""

from collections.abc import Sequence
from importlib.metadata import entry_points
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjsim.values.errors import SamplingError

GROUP = "mjsim.navigable"


class NavigablePoints(Protocol):
    """What sampling needs to know of the floor; points are (x, y) in m."""

    def sample(self, rng: np.random.Generator) -> NDArray[np.float64]:
        """A point (2,) drawn uniformly from the part of the floor that a person can walk over."""

    def is_navigable(self, point: ArrayLike) -> bool:
        """Whether a person can stand at a point (2,)."""

    def snap(self, point: ArrayLike, max_distance: float) -> NDArray[np.float64]:
        """The nearest point (2,) that `sample` could draw: the point itself if it is one."""


class NavigableFloor(NavigablePoints, Protocol):
    """The navigable floor of a house, with a map for users."""

    @property
    def topdown_map(self) -> NDArray[np.int32]:
        """The floor from above, shape (rows, columns): 0 where one can walk, -1 where not, else an island's number."""


class NavigableBuilder(Protocol):
    """Makes the navigable floor of a house."""

    def __call__(self, obstacles: Sequence[ArrayLike], bounds: Sequence[float], /) -> NavigableFloor:
        """Compute where one can walk among convex polygons (vertices, 2), m, within (x_min, y_min, x_max, y_max), m."""
        ...


def installed_builder(group: str = GROUP) -> NavigableBuilder:
    """The builder that an installed package registers, of several the first by name; `SamplingError` without one."""
    offers = sorted(entry_points(group=group), key=lambda e: e.name)
    if not offers:
        raise SamplingError(
            f"no installed package offers the entry point {group!r}, without which no house can be sampled; "
            "install the project (pip install -e .), pass navigable=..., or pass episodes=[...] sampled before"
        )
    try:
        builder: NavigableBuilder = offers[0].load()
    except (ImportError, AttributeError) as error:
        raise SamplingError(f"cannot load {offers[0].value!r}, which offers {group!r}: {error}") from error
    return builder
