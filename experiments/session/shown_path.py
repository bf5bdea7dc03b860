"""Paths to the next visit that a HUD can show: one as planned, and one from the person's position."""

import math

import numpy as np
from numpy.typing import NDArray

from experiments.participants.base import Point
from mjsim.world.walking.polyline import first_off_path, rest_of
from planner.geodesics import Geodesics

TOLERANCE = 0.6  # m; a new path is shown if the person is farther than this from the path
MAX_GOAL_SHIFT = 0.25  # m; a new path is shown if the goal was pushed farther than this


class ShownPath:
    """A shortest path, computed at the first access, that stays until its goal moves or the person leaves it.

    Args:
        geodesics: Finds the path.
        rerouted: True to replace the path when the person leaves it. The segment of a plan stays (PAPER section 5).
    """

    def __init__(self, geodesics: Geodesics, *, rerouted: bool) -> None:
        self._geodesics = geodesics
        self._rerouted = rerouted
        self._start = self._target = self._goal = np.zeros(2)
        self._points: NDArray[np.float64] | None = None

    def begin(self, start: Point, target: Point, goal: Point) -> None:
        """Show a new path from `start` to `target`.

        `goal` is the object or the receptacle. All are in m, shape (2,).
        """
        self._start, self._target, self._goal, self._points = start.copy(), target.copy(), goal.copy(), None

    @property
    def points(self) -> NDArray[np.float64]:
        """Points of the whole path, m, shape (k, 2). Raises UnreachableError if there is none."""
        if self._points is None:
            self._points = self._geodesics.shortest_path(self._start, self._target).points
        return self._points

    def ahead(self, position: Point) -> NDArray[np.float64]:
        """Return the path from its point nearest to the person, m, shape (k, 2)."""
        return np.asarray(rest_of(self.points, position[0], position[1]))

    def follow(self, positions: NDArray[np.float64], target: Point, goal: Point) -> None:
        """Show a new path each time the person has left the path. `positions` are successive, in m, shape (n, 2)."""
        off = -1
        while self._rerouted and self._points is not None:
            off = first_off_path(self._points, positions, off + 1, TOLERANCE)
            if off < 0:
                return
            self._renew(positions[off], target, goal)

    def follow_goal(self, position: Point, target: Point, goal: Point) -> None:
        """Show a new path if the goal has moved. `position` is the person's, m, shape (2,)."""
        if self._points is not None and math.dist(goal, self._goal) > MAX_GOAL_SHIFT:
            self._renew(position if self._rerouted else self._start, target, goal)

    def _renew(self, position: Point, target: Point, goal: Point) -> None:
        self.begin(position, target, goal)
        _ = self.points


class PathsToNext:
    """Paths to the next visit: the planned `segment` from the last visit, and the `path` from the person."""

    def __init__(self, geodesics: Geodesics) -> None:
        self.segment = ShownPath(geodesics, rerouted=False)
        self.path = ShownPath(geodesics, rerouted=True)

    def begin(self, last_visit: Point, position: Point, target: Point, goal: Point) -> None:
        """Show paths to another visit. All positions are in m, shape (2,), as in `ShownPath`."""
        self.segment.begin(last_visit, target, goal)
        self.path.begin(position, target, goal)

    def follow(self, position: Point, target: Point, goal: Point) -> None:
        """Show new paths if the person has left one or the goal has moved. All positions are in m, shape (2,)."""
        self.segment.follow_goal(position, target, goal)
        self.path.follow_goal(position, target, goal)
        self.path.follow(np.array([position]), target, goal)
