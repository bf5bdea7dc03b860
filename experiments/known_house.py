"""What a participant knows of the house after the familiarisation: ways, rooms and bins (PAPER section 7)."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from planner.geodesics import Geodesics
from planner.navmesh import NavMesh

Point = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class KnownHouse:
    """The map in a person's head.

    Attributes:
        navmesh: Where one can walk.
        geodesics: Shortest ways.
        bins: Receptacle key -> horizontal position of its middle, m, shape (2,).
        approaches: Receptacle key -> where one stands to use it, m, shape (2,).
        viewpoints: Room key -> places from which the room can be looked over, m, shape (k, 2).
    """

    navmesh: NavMesh
    geodesics: Geodesics
    bins: Mapping[str, Point]
    approaches: Mapping[str, Point]
    viewpoints: Mapping[str, NDArray[np.float64]]

    @cached_property
    def outline(self) -> NDArray[np.float64]:
        """Edges of where one can walk: x, y of one end and of the other, m, shape (e, 4)."""
        return self.navmesh.outline()

    def path(self, start: Point, goal: Point) -> NDArray[np.float64]:
        """Floor points of the shortest way, m, shape (k, 2).

        Raises:
            UnreachableError: There is no way.
        """
        return self.geodesics.shortest_path(start, goal).points

    def distance(self, start: Point, goal: Point) -> float:
        """Length of the shortest way, m.

        Raises:
            UnreachableError: There is no way.
        """
        return self.geodesics.shortest_path(start, goal).geodesic_distance

    def stand_for_object(self, position: Point) -> Point:
        """Where one stands to pick up something at `position`: the nearest navigable point, shape (2,)."""
        return self.navmesh.snap(position)


def spread_viewpoints(points: NDArray[np.float64], spacing: float) -> NDArray[np.float64]:
    """Choose points that cover a set: farthest-point selection until all lie within `spacing` m of one chosen.

    Args:
        points: Candidates, m, shape (m, 2), m >= 1.
        spacing: Largest distance left uncovered, m.

    Returns:
        The chosen points, shape (k, 2), the most central one first.
    """
    chosen = [int(np.argmin(np.linalg.norm(points - points.mean(axis=0), axis=1)))]
    gap = np.linalg.norm(points - points[chosen[0]], axis=1)
    while gap.max() > spacing:
        farthest = int(np.argmax(gap))
        chosen.append(farthest)
        gap = np.minimum(gap, np.linalg.norm(points - points[farthest], axis=1))
    return points[chosen]
