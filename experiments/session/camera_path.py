"""Compute the camera path of the fly-through, which visits all rooms and shows all bins."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from experiments.house import House
from experiments.participants.base import Point, estimated_distance
from mjsim.house.compiled.house import compiled_house
from mjsim.house.sight.sight import FieldOfView, visible_receptacles
from mjsim.values.person_parameters import PersonParameters

# Eye height of the default person, so that all participants see the same film
EYE_HEIGHT = PersonParameters().eye_height
STEP = 0.04  # time between two camera poses, in seconds
SPEED = 1.3  # walking speed in m/s
TURNING = math.radians(75.0)  # turning speed in rad/s
LOOK_AHEAD = 0.8  # distance ahead on the path at which the moving camera looks, in metres
BIN_TIME = 2.0  # how long the camera looks at each bin, in seconds
# Distances from the end of the path to a bin, in metres. They are tried in turn until the bin is visible.
BIN_DISTANCES = (1.5, 1.0, 0.6, 0.3, 0.0)
SMOOTHING = 0.25  # standard deviation of the Gaussian filter in seconds
_FIELD = FieldOfView.of(PersonParameters())


@dataclass(frozen=True, eq=False)
class CameraPath:
    """Camera poses at intervals of `STEP` seconds, with the bin that the camera looks at in each pose."""

    positions: NDArray[np.float64]  # camera positions in metres, shape (n, 3)
    headings: NDArray[np.float64]  # yaw of the gaze in radians, 0 along +x, counter-clockwise, shape (n,)
    pitches: NDArray[np.float64]  # elevation of the gaze in radians, shape (n,)
    bins: tuple[str | None, ...]  # key of the bin that the camera looks at, or None, for each pose

    @property
    def duration(self) -> float:
        return len(self.headings) * STEP

    def at(self, times: NDArray[np.float64]) -> "CameraPath":
        """Return the part of the camera path at the times (m,) in seconds."""
        rows = np.minimum((times / STEP).astype(np.int64), len(self.headings) - 1)
        bins = tuple(self.bins[row] for row in rows)
        return CameraPath(self.positions[rows], self.headings[rows], self.pitches[rows], bins)


@dataclass(frozen=True, eq=False)
class _Stop:
    place: Point
    bin: str | None = None


class _Camera:
    def __init__(self, house: House, start: Point) -> None:
        self._house = house
        self.place, self.heading, self.pitch = start, 0.0, 0.0
        self.rows: list[NDArray[np.float64]] = []
        self.bins: list[str | None] = []

    def move(self, place: Point) -> None:
        points = np.asarray(self._house.geodesics.shortest_path(self.place, place).points)
        gaps = np.linalg.norm(np.diff(points, axis=0), axis=1)
        along = np.concatenate([[0.0], np.cumsum(gaps)])
        if along[-1] < 1e-6:
            return
        at = np.arange(0.0, along[-1], SPEED * STEP)
        ahead = np.minimum(at + LOOK_AHEAD, along[-1])
        here, there = _interpolate(points, along, at), _interpolate(points, along, ahead)
        offsets = there - here
        # near its destination, the camera keeps its direction
        offsets[np.linalg.norm(offsets, axis=1) < 0.1] = points[-1] - points[-2]
        headings = np.unwrap(np.arctan2(offsets[:, 1], offsets[:, 0]))
        self.turn(float(headings[0]))
        headings += self.heading - headings[0]
        self._add(np.column_stack([here, headings, np.zeros(len(at))]))
        self.place = points[-1]

    def turn(self, heading: float, pitch: float = 0.0) -> None:
        change = (heading - self.heading + math.pi) % (2.0 * math.pi) - math.pi
        self.turn_by(change, pitch)

    def look_at(self, key: str) -> None:
        offset = self._house.receptacles[key].center - np.array([*self.place, EYE_HEIGHT])
        pitch = math.atan2(offset[2], math.hypot(offset[0], offset[1]))
        self.turn(math.atan2(offset[1], offset[0]), pitch)
        rest = np.array([*self.place, self.heading, self.pitch])
        self._add(np.tile(rest, (round(BIN_TIME / STEP), 1)), key)

    def turn_by(self, change: float, pitch: float) -> None:
        count = max(1, math.ceil(max(abs(change), abs(pitch - self.pitch)) / (TURNING * STEP)))
        share = np.arange(1, count + 1) / count
        rows = np.empty((count, 4))
        rows[:, :2] = self.place
        rows[:, 2] = self.heading + share * change
        rows[:, 3] = self.pitch + share * (pitch - self.pitch)
        self._add(rows)

    def _add(self, rows: NDArray[np.float64], key: str | None = None) -> None:
        self.rows.append(rows)
        self.bins += [key] * len(rows)
        self.heading, self.pitch = float(rows[-1, 2]), float(rows[-1, 3])


def camera_path(house: House) -> CameraPath:
    """Return the camera path through a house. The same house always gives the same path.

    In each room, the camera first looks around from the central viewpoint. It then visits the bins of the
    room, always choosing the nearest unvisited bin. Finally, it moves on to the nearest unvisited room.
    """
    stops = {room: _stops(house, room) for room in house.viewpoints}
    room = next(iter(stops))
    camera = _Camera(house, stops[room][0].place)
    while True:
        for stop in _nearest_first(house, stops.pop(room)):
            camera.move(stop.place)
            if stop.bin is None:
                camera.turn_by(2.0 * math.pi, 0.0)
            else:
                camera.look_at(stop.bin)
        if not stops:
            break
        room = min(stops, key=lambda key: estimated_distance(house, camera.place, stops[key][0].place))
    rows = np.vstack(camera.rows)
    smooth = gaussian_filter1d(rows, SMOOTHING / STEP, axis=0, mode="nearest")
    positions = np.column_stack([smooth[:, :2], np.full(len(rows), EYE_HEIGHT)])
    return CameraPath(positions, smooth[:, 2], smooth[:, 3], tuple(camera.bins))


def bins_seen(house: House, path: CameraPath, field: FieldOfView, interval: float) -> dict[str, float]:
    """Return the time in seconds at which each bin first becomes visible to a person who watches the film.

    Visibility is checked every `interval` seconds. The result does not contain bins that are never visible.
    """
    compiled = compiled_house(house.catalogue)
    times = np.arange(0.0, path.duration, interval)
    rows, left, seen = path.at(times), dict(house.receptacles), dict[str, float]()
    for time, position, heading, pitch in zip(
        times.tolist(), rows.positions, rows.headings.tolist(), rows.pitches.tolist(), strict=True
    ):
        found = visible_receptacles(
            compiled.model, compiled.data, left, position, heading, pitch, field=field
        )
        for key in sorted(found):
            seen[key] = round(time, 6)
            del left[key]
        if not left:
            break
    return seen


def _stops(house: House, room: str) -> list[_Stop]:
    middle = house.viewpoints[room][0]
    keys = [key for key, entry in house.catalogue.receptacles.items() if entry.room == room]
    return [_Stop(middle), *(_Stop(_bin_place(house, middle, key), key) for key in keys)]


def _bin_place(house: House, start: Point, key: str) -> Point:
    points = np.asarray(house.geodesics.shortest_path(start, house.approaches[key]).points)
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    compiled, bin_ = compiled_house(house.catalogue), house.receptacles[key]
    for left in BIN_DISTANCES:
        place = _interpolate(points, along, np.array([max(0.0, along[-1] - left)]))[0]
        eye = np.array([*place, EYE_HEIGHT])
        offset = bin_.center - eye
        heading = math.atan2(offset[1], offset[0])
        pitch = math.atan2(offset[2], math.hypot(offset[0], offset[1]))
        if visible_receptacles(compiled.model, compiled.data, {key: bin_}, eye, heading, pitch, field=_FIELD):
            break
    return np.asarray(place)


def _nearest_first(house: House, stops: Sequence[_Stop]) -> Iterator[_Stop]:
    left = list(stops)
    stop = left.pop(0)
    yield stop
    while left:
        gaps = [estimated_distance(house, stop.place, other.place) for other in left]
        stop = left.pop(int(np.argmin(gaps)))
        yield stop


def _interpolate(
    points: NDArray[np.float64], along: NDArray[np.float64], at: NDArray[np.float64]
) -> NDArray[np.float64]:
    return np.asarray(np.column_stack([np.interp(at, along, points[:, i]) for i in range(2)]))
