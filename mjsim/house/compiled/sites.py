"""Read the rooms and receptacles of a compiled house from its sites."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjsim.support.kernels import kernel
from mjsim.values.errors import AssetError

PREFIX = "room:"
PLACE = "place:"  # first part of the names of sites on furniture where objects can lie


@dataclass(frozen=True, eq=False)
class RoomMap:
    """The rooms of a house. Each room consists of one or more rectangles on the floor (PAPER section 5)."""

    # Room key -> label shown to participants, such as "Kitchen", in the order of the catalogue.
    labels: Mapping[str, str]
    keys: tuple[str, ...]  # key of the room to which each rectangle belongs, length k
    centers: NDArray[np.float64]  # centres of the rectangles in metres, shape (k, 2)
    half_sizes: NDArray[np.float64]  # half extents of the rectangles in metres, shape (k, 2)
    axes: NDArray[np.float64]  # axes of the rectangles as columns, shape (k, 2, 2)

    @classmethod
    def from_model(cls, model: mujoco.MjModel, labels: Mapping[str, str] | None = None) -> "RoomMap":
        """Read the rooms from the box sites `room:<key>` and `room:<key>:<n>`. Labels default to the keys.

        Raises:
            AssetError: A room has no site, a site belongs to no room, or a site is not an upright box.
        """
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        names = {site: model.site(site).name for site in range(model.nsite)}
        sites = [site for site, name in names.items() if name.startswith(PREFIX)]
        keys = [names[site].removeprefix(PREFIX).split(":")[0] for site in sites]
        if not sites:
            raise AssetError(f"the house has no site '{PREFIX}<key>'; mark its rooms with box sites")
        if labels is None:
            labels = {key: key for key in keys}
        for site, key in zip(sites, keys, strict=True):
            if key not in labels:
                raise AssetError(f"site {names[site]!r} names a room that is not in {sorted(labels)}")
            upright = abs(data.site_xmat[site, 8]) > 1 - 1e-6
            if model.site_type[site] != mujoco.mjtGeom.mjGEOM_BOX or not upright:
                raise AssetError(
                    f"site {names[site]!r} must be of type box and turned about the vertical only"
                )
        missing = sorted(set(labels) - set(keys))
        if missing:
            raise AssetError(f"rooms {missing} of the catalogue have no site '{PREFIX}<key>' in the house")
        rotations = data.site_xmat[sites].reshape(-1, 3, 3)
        return cls(
            labels=dict(labels),
            keys=tuple(keys),
            centers=data.site_xpos[sites, :2].copy(),
            half_sizes=model.site_size[sites, :2].copy(),
            axes=rotations[:, :2, :2].copy(),
        )

    def distances(self, xy: ArrayLike) -> NDArray[np.float64]:
        """Return the distance from each point (..., 2) to each rectangle, in metres, shape (..., k)."""
        offsets = np.asarray(xy, dtype=np.float64)[..., None, :2] - self.centers
        local = np.einsum("kji,...kj->...ki", self.axes, offsets)
        outside = np.maximum(np.abs(local) - self.half_sizes, 0.0)
        return np.asarray(np.hypot(outside[..., 0], outside[..., 1]))

    def room_at(self, xy: ArrayLike) -> str:
        """Return the key of the room at a point (2,), or of the nearest room if the point is in none."""
        return self.keys[int(np.argmin(self.distances(xy)))]

    def contains(self, xy: ArrayLike, margin: float = 0.0) -> bool:
        """Return True if a point (2,) is inside a room, or at most `margin` metres away from one."""
        x, y = np.asarray(xy, dtype=np.float64)[:2].tolist()
        return bool(nearest_rectangle(x, y, *self.rectangles) <= margin)

    @property
    def rectangles(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """The centres (k, 2), half sizes (k, 2) and axes (k, 2, 2) of all rectangles, in metres."""
        return self.centers, self.half_sizes, self.axes

    @property
    def corners(self) -> NDArray[np.float64]:
        """The corners of all rectangles in metres, counter-clockwise, shape (k, 4, 2)."""
        signs = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
        return np.array([c + (signs * half) @ axes.T for c, half, axes in zip(*self.rectangles, strict=True)])

    def label(self, key: str) -> str:
        """Return the label of a room. Raise an AssetError if the room does not exist."""
        if key not in self.labels:
            raise AssetError(f"no room {key!r}; the house has {sorted(self.labels)}")
        return self.labels[key]

    @property
    def area(self) -> float:
        """The total area of all rectangles in square metres. Overlapping areas count twice."""
        return float(4 * self.half_sizes.prod(axis=1).sum())

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """The axis-aligned bounding box of all rooms in metres: (xmin, ymin, xmax, ymax)."""
        reach = np.einsum("kij,kj->ki", np.abs(self.axes), self.half_sizes)
        low, high = (self.centers - reach).min(axis=0), (self.centers + reach).max(axis=0)
        return float(low[0]), float(low[1]), float(high[0]), float(high[1])


@kernel
def nearest_rectangle(
    x: float,
    y: float,
    centers: NDArray[np.float64],
    half_sizes: NDArray[np.float64],
    axes: NDArray[np.float64],
) -> float:
    """Return the distance from a point to the nearest rectangle, in metres, or 0 inside a rectangle."""
    nearest = math.inf
    for k in range(len(centers)):
        dx, dy = x - centers[k, 0], y - centers[k, 1]
        u = max(abs(axes[k, 0, 0] * dx + axes[k, 1, 0] * dy) - half_sizes[k, 0], 0.0)
        v = max(abs(axes[k, 0, 1] * dx + axes[k, 1, 1] * dy) - half_sizes[k, 1], 0.0)
        nearest = min(nearest, math.hypot(u, v))
    return nearest


@dataclass(frozen=True, eq=False)
class ReceptacleGeometry:
    """The position and size of a receptacle in a house."""

    key: str
    # Centre, in metres, of the volume in which objects count as delivered, shape (3,).
    center: NDArray[np.float64]
    half_size: NDArray[np.float64]  # half extents of the volume along its own axes, in metres, shape (3,)
    rotation: NDArray[np.float64]  # axes of the volume as columns, shape (3, 3)
    approach: NDArray[np.float64]  # position of a person who uses the receptacle, in metres, shape (2,)

    def contains(self, point: ArrayLike, margin: float = 0.005) -> bool:
        """Return True if a point (3,) is inside the volume or at most `margin` metres away from its sides."""
        local = self.rotation.T @ (np.asarray(point, dtype=np.float64) - self.center)
        return bool(np.all(np.abs(local) <= self.half_size + margin))

    def distance(self, xy: NDArray[np.float64]) -> float:
        """Return the horizontal distance from a point (2,) on the floor to the volume, in metres."""
        local = self.rotation.T @ np.array([*(xy - self.center[:2]), 0.0])
        outside = np.maximum(np.abs(local) - self.half_size, 0.0)
        return float(np.hypot(outside[0], outside[1]))

    def nearest(self, xy: NDArray[np.float64], margin: float = 0.0) -> NDArray[np.float64]:
        """Return the point (2,) nearest to `xy` that is at most `margin` metres away from the volume's sides."""
        local = self.rotation.T @ np.array([*(xy - self.center[:2]), 0.0])
        inside = np.clip(local, -self.half_size - margin, self.half_size + margin)
        return np.asarray((self.center + self.rotation @ inside)[:2])


def object_places(model: mujoco.MjModel, data: mujoco.MjData) -> NDArray[np.float64]:
    """Return the positions of all sites `place:<n>`, in metres, shape (k, 3)."""
    sites = [site for site in range(model.nsite) if model.site(site).name.startswith(PLACE)]
    return np.asarray(data.site_xpos[sites]).reshape(-1, 3)


def receptacle_geometries(model: mujoco.MjModel, keys: Iterable[str]) -> dict[str, ReceptacleGeometry]:
    """Read the geometry of receptacles from the sites `<key>/volume` and `<key>/approach` of a model."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    found = {}
    for key in keys:
        volume, approach = _site(model, key, "volume"), _site(model, key, "approach")
        if model.site_type[volume] != mujoco.mjtGeom.mjGEOM_BOX:
            raise AssetError(f"site 'volume' of receptacle {key!r} must be of type box")
        found[key] = ReceptacleGeometry(
            key=key,
            center=data.site_xpos[volume].copy(),
            half_size=model.site_size[volume].copy(),
            rotation=data.site_xmat[volume].reshape(3, 3).copy(),
            approach=data.site_xpos[approach, :2].copy(),
        )
    return found


def _site(model: mujoco.MjModel, key: str, name: str) -> int:
    site = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, f"{key}/{name}")
    if site < 0:
        raise AssetError(f"receptacle {key!r} has no site {name!r}; add it to its model")
    return int(site)
