"""Draw outlines of models for the images that `mjsim check` writes, without OpenGL."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from mjsim.house.compiled.footprint import outline_points
from mjsim.house.compiled.sites import ReceptacleGeometry, RoomMap
from mjsim.house.validation.checked_model import Compiled
from mjsim.values.episode import Episode
from mjsim.values.errors import AssetError

Point = tuple[float, float]
_BAND = (0.05, 1.8)  # range of heights in which the geoms of a house are drawn, in metres


@dataclass(frozen=True, eq=False)
class Drawing:
    """A drawing of the outlines of a model, seen along an axis, in metres."""

    title: str  # title of the drawing
    axes: tuple[int, int]  # indices of the right and up coordinates, such as (0, 1) in a view from above
    outlines: tuple[NDArray[np.float64], ...]  # outlines as convex polygons, each of shape (k, 2)
    rooms: tuple[tuple[str, NDArray[np.float64]], ...] = ()  # name and corners (4, 2) of each room rectangle
    marks: Mapping[str, Point] = field(default_factory=dict)  # named positions, such as those of sites


def floor_view(
    compiled: Compiled,
    rooms: RoomMap | None = None,
    receptacles: Mapping[str, ReceptacleGeometry] | None = None,
    episode: Episode | None = None,
) -> Drawing:
    """Draw a house from above, optionally with the objects and the start position of an episode."""
    marks = {key: _point(r.center, (0, 1)) for key, r in (receptacles or {}).items()}
    if episode is not None:
        marks |= {o.name: _point(o.position, (0, 1)) for o in episode.objects}
        marks["start"] = (episode.start.x, episode.start.y)
    return Drawing("from above", (0, 1), _outlines(compiled, (0, 1), _BAND), _rectangles(rooms), marks)


def side_views(compiled: Compiled) -> tuple[Drawing, ...]:
    """Draw an object or receptacle and its sites from above, from the front and from the right."""
    sites = {compiled.model.site(s).name: compiled.data.site_xpos[s] for s in range(compiled.model.nsite)}
    return tuple(
        Drawing(title, axes, _outlines(compiled, axes), marks={n: _point(p, axes) for n, p in sites.items()})
        for title, axes in (("from above", (0, 1)), ("from the front", (0, 2)), ("from the right", (1, 2)))
    )


def _point(place: object, axes: tuple[int, int]) -> Point:
    values = np.asarray(place, dtype=np.float64)
    return float(values[axes[0]]), float(values[axes[1]])


def _rectangles(rooms: RoomMap | None) -> tuple[tuple[str, NDArray[np.float64]], ...]:
    if rooms is None:
        return ()
    return tuple((rooms.labels.get(k, k), c) for k, c in zip(rooms.keys, rooms.corners, strict=True))


def _outlines(
    compiled: Compiled, axes: tuple[int, int], band: tuple[float, float] | None = None
) -> tuple[NDArray[np.float64], ...]:
    right, up = (np.eye(3)[a] for a in axes)
    turn = np.array([right, up, np.cross(right, up)])
    found = []
    for geom in compiled.solid:
        if compiled.model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE:
            continue
        try:
            if band is not None:
                heights = compiled.points(int(geom))[:, 2]
                if heights.max() <= band[0] or heights.min() >= band[1]:
                    continue
            rotation = compiled.data.geom_xmat[geom].reshape(3, 3)
            points = outline_points(
                compiled.model, int(geom), turn @ compiled.data.geom_xpos[geom], turn @ rotation
            )
            found.append(points[ConvexHull(points[:, :2]).vertices, :2])
        except (AssetError, QhullError, ValueError):  # Flat or infinite geoms are reported by another rule.
            continue
    return tuple(found)
