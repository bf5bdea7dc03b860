"""Compute the paths that the HUD shows: the planned path, and the path from the person's position."""

import math

import numpy as np
from numpy.typing import NDArray

from experiments.participants.base import Point
from mjsim.world.walking.polyline import first_off_path, rest_of
from planner.geodesics import Geodesics

TOLERANCE = 0.6  # distance from the path beyond which a new path is computed, in metres
MAX_GOAL_SHIFT = 0.25  # displacement of the goal beyond which a new path is computed, in metres


class ShownPath:
    """A shortest path for the HUD, which is replaced if its goal moves or the person leaves it.

    Args:
        geodesics: Geodesics used to find the path.
        rerouted: True to replace the path when the person leaves it, False to keep it (PAPER section 5).
    """

    def __init__(self, geodesics: Geodesics, *, rerouted: bool) -> None:
        self._geodesics = geodesics
        self._rerouted = rerouted
        self._start = self._target = self._goal = np.zeros(2)
        self._points: NDArray[np.float64] | None = None

    def begin(self, start: Point, target: Point, goal: Point) -> None:
        """Set the start and the end of a new path.

        `goal` is the position of the object or receptacle. All positions are in metres, shape (2,).
        """
        self._start, self._target, self._goal, self._points = start.copy(), target.copy(), goal.copy(), None

    @property
    def points(self) -> NDArray[np.float64]:
        """Points of the whole path in metres, shape (k, 2). Raises UnreachableError if there is no path."""
        if self._points is None:
            self._points = self._geodesics.shortest_path(self._start, self._target).points
        return self._points

    def ahead(self, position: Point) -> NDArray[np.float64]:
        """Return the part of the path ahead of the person in metres, shape (k, 2)."""
        return np.asarray(rest_of(self.points, position[0], position[1]))

    def follow(self, positions: NDArray[np.float64], target: Point, goal: Point) -> None:
        """Replace the path each time the person leaves it.

        `positions` are the person's successive positions in metres, shape (n, 2).
        """
        off = -1
        while self._rerouted and self._points is not None:
            off = first_off_path(self._points, positions, off + 1, TOLERANCE)
            if off < 0:
                return
            self._renew(positions[off], target, goal)

    def follow_goal(self, position: Point, target: Point, goal: Point) -> None:
        """Replace the path if the goal has moved. `position` is the person's position in metres."""
        if self._points is not None and math.dist(goal, self._goal) > MAX_GOAL_SHIFT:
            self._renew(position if self._rerouted else self._start, target, goal)

    def _renew(self, position: Point, target: Point, goal: Point) -> None:
        self.begin(position, target, goal)
        _ = self.points


class PathsToNext:
    """The paths to the next visit: `segment` from the last visit, and `path` from the person's position."""

    def __init__(self, geodesics: Geodesics) -> None:
        self.segment = ShownPath(geodesics, rerouted=False)
        self.path = ShownPath(geodesics, rerouted=True)

    def begin(self, last_visit: Point, position: Point, target: Point, goal: Point) -> None:
        """Start new paths to another visit. All positions are in metres, shape (2,)."""
        self.segment.begin(last_visit, target, goal)
        self.path.begin(position, target, goal)

    def follow(self, position: Point, target: Point, goal: Point) -> None:
        """Replace `path` if the person has left it, or both paths if the goal has moved.

        All positions are in metres, shape (2,).
        """
        self.segment.follow_goal(position, target, goal)
        self.path.follow_goal(position, target, goal)
        self.path.follow(np.array([position]), target, goal)
