"""Places on the floor from which a person can reach a receptacle or an object without reaching around a wall."""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.house.compiled.house import CompiledHouse, NavigablePoints
from mjsim.house.compiled.rays import RIM, first_hit, receptacle_in_sight
from mjsim.house.compiled.sites import ReceptacleGeometry, RoomMap
from mjsim.values.person_parameters import PersonParameters

Point = NDArray[np.float64]
Goal = Point | ReceptacleGeometry
"""A receptacle, or the floor position of an object in metres, shape (2,)."""

REACH_HEIGHT = 1.15  # height at which a hand passes over furniture, in metres
# Half widths of the free space that an arm needs, at the body and at the goal, in metres
SHOULDERS, HANDS = 0.15, 0.05
DOORWAY_WIDTH = 1.2  # maximum distance between the two sides of a doorway, in metres
DOORWAY_DEPTH = 0.2  # maximum distance between a person in a doorway and the wall around it, in metres
DISTANCES = (0.72, 0.56)  # distances of candidate places from a goal, relative to the reach
DIRECTIONS = 24  # number of directions of candidate places
APART = 0.4  # minimum distance from places that are to be avoided, in metres


@dataclass(frozen=True, eq=False)
class StandingPlaces:
    """The places in a house where a person can stand to pick up or place objects.

    Attributes:
        model: Compiled house without objects.
        data: Initial state of the house.
        navigable: Floor on which this person can walk.
    """

    model: mujoco.MjModel
    data: mujoco.MjData
    rooms: RoomMap
    navigable: NavigablePoints
    person: PersonParameters

    @classmethod
    def of(
        cls, house: CompiledHouse, navigable: NavigablePoints, person: PersonParameters
    ) -> "StandingPlaces":
        return cls(house.model, house.data, house.rooms, navigable, person)

    def suits(self, stand: Point, goal: Goal) -> bool:
        """Return True if nothing obstructs a straight reach from a place to a goal.

        The place must not be in a doorway if the goal is a receptacle. Objects may be in the doorway themselves.
        """
        if isinstance(goal, ReceptacleGeometry):
            return self.is_free(stand, goal) and not self.in_doorway(stand)
        return self.is_free(stand, goal)

    def is_free(self, stand: Point, goal: Goal) -> bool:
        """Return True if no wall or tall piece of furniture is in the way of a straight reach."""
        if isinstance(goal, ReceptacleGeometry):
            height, end = max(REACH_HEIGHT, goal.center[2] + goal.half_size[2]), goal.nearest(stand, RIM)
        else:
            height, end = REACH_HEIGHT, goal
        along = end - stand
        length = math.hypot(*along)
        if length < RIM:
            return True
        across = np.array([-along[1], along[0]]) / length
        for side in (-1.0, 0.0, 1.0):
            start = stand + side * SHOULDERS * across
            ray = end + side * HANDS * across - start
            if first_hit(self.model, self.data, (*start, height), (*ray, 0.0), reach=1.0)[0] < 1.0:
                return False
        return True

    def in_doorway(self, point: Point) -> bool:
        """Return True if a part of the body has walls on two opposite sides, and different rooms on the other two."""
        for angle in np.arange(8) * math.pi / 8:
            across = np.array([math.cos(angle), math.sin(angle), 0.0])
            ahead = DOORWAY_DEPTH * np.array([-across[1], across[0]])
            if self.rooms.room_at(point + ahead) == self.rooms.room_at(point - ahead):
                continue
            for part in np.linspace(-1.0, 1.0, 5):  # no wall fits between two of these parts
                start = (*(point + part * ahead), REACH_HEIGHT)
                sides = (first_hit(self.model, self.data, start, side)[0] for side in (across, -across))
                if sum(sides) < DOORWAY_WIDTH:
                    return True
        return False

    def around(self, goal: Goal, avoid: Sequence[Point] = ()) -> list[Point]:
        """Return suitable places around a goal that are not close to the places in `avoid`."""
        return [
            place
            for place in self._navigable_around(goal)
            if all(math.dist(place, other) >= APART for other in avoid) and self.suits(place, goal)
        ]

    def instead_of(self, stand: Point, goal: Goal) -> Point | None:
        """Return the suitable place nearest to `stand`. Return None if `stand` is suitable or no place is."""
        found = [] if self.suits(stand, goal) else self.around(goal)
        return min(found, key=lambda place: math.dist(place, stand), default=None)

    def needs_doorway(self, goal: Goal, stand: Point) -> bool:
        """Return True if all places with a free reach, including `stand`, are in doorways, or if there are none."""
        places = itertools.chain([stand], self._navigable_around(goal))
        return not any(self.is_free(place, goal) and not self.in_doorway(place) for place in places)

    def _navigable_around(self, goal: Goal) -> Iterator[Point]:
        """Yield places on the largest island around a goal. A receptacle must be visible from them."""
        for share, k in itertools.product(DISTANCES, range(DIRECTIONS)):
            angle = 2 * math.pi * k / DIRECTIONS
            place = middle(goal) + share * self.person.reach * np.array([math.cos(angle), math.sin(angle)])
            if math.dist(self.navigable.snap(place, math.inf), place) > 0.0:
                continue
            eye = np.array([*place, self.person.eye_height])
            if not isinstance(goal, ReceptacleGeometry) or receptacle_in_sight(
                self.model, self.data, eye, goal
            ):
                yield place


def middle(goal: Goal) -> Point:
    return goal.center[:2] if isinstance(goal, ReceptacleGeometry) else goal
