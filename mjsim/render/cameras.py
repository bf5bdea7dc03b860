"""Cameras: poses, view volumes, and culling of geoms outside the view."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjsim.house.scene.avatar import EYE
from mjsim.values.errors import RenderError
from mjsim.values.person_parameters import PICTURE_ASPECT

# Distances of the clipping planes in metres. The body keeps the eye farther than `NEAR` from all surfaces.
NEAR = 0.04
FAR = 100.0
_MARGIN = 0.01  # tolerance of culling, far above rounding errors in single precision, in metres
_NOTHING = int(mujoco.mjtGeom.mjGEOM_NONE)  # geom type that the rasteriser does not draw
# An integer, because comparing with the enumeration takes ten times as long
_GEOM = int(mujoco.mjtObj.mjOBJ_GEOM)


@dataclass(frozen=True, eq=False)
class CameraPose:
    """A pinhole camera."""

    position: NDArray[np.float64]  # eye point in the house frame, in metres, shape (3,)
    # camera axes in the house frame as columns: x right, y up, z backward, shape (3, 3)
    rotation: NDArray[np.float64]
    fovy: float  # vertical field of view, in radians

    def __post_init__(self) -> None:
        position = np.asarray(self.position, dtype=np.float64)
        rotation = np.asarray(self.rotation, dtype=np.float64)
        if position.shape != (3,) or not np.isfinite(position).all():
            raise RenderError(f"camera position must be three finite numbers, got {self.position!r}")
        if rotation.shape != (3, 3) or not np.allclose(rotation.T @ rotation, np.eye(3), atol=1e-6):
            raise RenderError(f"camera rotation must be an orthonormal 3x3 matrix, got {self.rotation!r}")
        if not 0.0 < self.fovy < np.pi:
            raise RenderError(f"camera fovy must lie between 0 and pi rad, got {self.fovy}")
        object.__setattr__(self, "position", position)
        object.__setattr__(self, "rotation", rotation)

    @classmethod
    def looking_at(cls, position: ArrayLike, target: ArrayLike, fovy: float) -> "CameraPose":
        """Create an upright camera at `position` that looks at `target`, both in metres, shape (3,)."""
        eye = np.asarray(position, dtype=np.float64)
        return cls(eye, look_rotation(np.asarray(target, dtype=np.float64) - eye), fovy)


def look_rotation(direction: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the axes, shape (3, 3), of an upright camera that looks along `direction`.

    For a vertical direction, the top of the image is towards +y.
    """
    length = np.linalg.norm(direction)
    if not length > 0.0:
        raise RenderError(f"a camera cannot look along {direction!r}; give a target away from its position")
    backward = -direction / length
    vertical = abs(backward[2]) > 1.0 - 1e-9
    right = np.cross([0.0, 1.0, 0.0] if vertical else [0.0, 0.0, 1.0], backward)
    right /= np.linalg.norm(right)
    return np.column_stack((right, np.cross(backward, right), backward))


@dataclass(frozen=True, eq=False)
class ViewVolume:
    """View volume of a draw call."""

    position: NDArray[np.float64]  # eye point in metres, shape (3,)
    rotation: NDArray[np.float64]  # camera axes as columns: right, up, backward, shape (3, 3)
    half_height: float  # half height of the image at a distance of 1 m, or in metres if orthographic
    near: float = NEAR  # distance of the near plane, in metres
    far: float = FAR  # distance of the far plane, in metres
    orthographic: bool = False

    @classmethod
    def of(cls, pose: CameraPose) -> "ViewVolume":
        return cls(pose.position, pose.rotation, float(np.tan(pose.fovy / 2)))

    def metres(self, raw: NDArray[np.float32]) -> NDArray[np.float32]:
        """Convert reversed depth (1 near, 0 far) to distance along the optical axis in metres."""
        depth = np.divide(self.near * self.far, self.near + raw.astype(np.float64) * (self.far - self.near))
        if self.orthographic:
            depth = self.far - raw.astype(np.float64) * (self.far - self.near)
        depth[raw <= 0.0] = np.inf
        return depth.astype(np.float32)

    def aim(self, scene: Any) -> None:
        top = self.half_height if self.orthographic else self.half_height * self.near
        forward = -self.rotation[:, 2]
        for camera in scene.camera:  # MuJoCo averages the two cameras of a scene if it is not in stereo
            camera.pos, camera.forward, camera.up = self.position, forward, self.rotation[:, 1]
            camera.frustum_center, camera.frustum_width = 0.0, 0.0
            camera.frustum_bottom, camera.frustum_top = -top, top
            camera.frustum_near, camera.frustum_far = self.near, self.far
            camera.orthographic = int(self.orthographic)
        for light in scene.lights[: scene.nlight]:
            if light.headlight:
                light.pos, light.dir = self.position, forward


def camera_pose(model: Any, data: Any, camera: str | CameraPose, aspect: float) -> CameraPose:
    """Return the pose of a camera of the model, or `camera` itself if it is a pose. `aspect` is width over height.

    The eye camera keeps the person's horizontal field of view at every aspect ratio. Other cameras keep their vertical
    field of view, as in MuJoCo. Raises a RenderError for an unknown camera.
    """
    if isinstance(camera, CameraPose):
        return camera
    index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_CAMERA, camera)
    if index < 0:
        names = [model.camera(i).name for i in range(model.ncam)]
        raise RenderError(f"the model has no camera {camera!r}; it has {names}")
    rotation = data.cam_xmat[index].reshape(3, 3).copy()
    fovy = float(np.deg2rad(model.cam_fovy[index]))
    if camera == EYE and aspect != PICTURE_ASPECT:
        fovy = 2.0 * float(np.arctan(np.tan(fovy / 2.0) * PICTURE_ASPECT / aspect))
    return CameraPose(data.cam_xpos[index].copy(), rotation, fovy)


class Bounds(NamedTuple):
    """Bounding spheres and boxes of a model's geoms, in the geoms' frames."""

    radii: NDArray[
        np.float64
    ]  # radii of spheres around the origins in metres, 0 for unbounded geoms, shape (ngeom,)
    boxes: NDArray[np.float64]  # centres and half sizes of boxes in metres, shape (ngeom, 6)

    @classmethod
    def of(cls, model: Any) -> "Bounds":
        """Compute the bounds of a model. Planes of finite size are bounded, unlike in MuJoCo."""
        radii, boxes = model.geom_rbound.copy(), model.geom_aabb.copy()
        plane = model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE
        finite = plane & (model.geom_size[:, :2] > 0.0).all(axis=1)
        half = model.geom_size[finite, :2]
        radii[finite] = np.hypot(*half.T)
        boxes[finite] = np.pad(half, ((0, 0), (3, 1)))
        return cls(radii, boxes)


def outside(
    view: ViewVolume, aspect: float, centres: NDArray[np.float64], radii: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Return a mask (n,) of the spheres outside a view. Some near its corners are missed. Radius 0 means unbounded."""
    right, up, backward = ((centres - view.position) @ view.rotation).T
    ahead, reach = -backward, radii + _MARGIN
    vertical, horizontal = view.half_height, view.half_height * aspect
    apart = (ahead + reach < view.near) | (ahead - reach > view.far)
    for offset, half in ((right, horizontal), (up, vertical)):
        if view.orthographic:
            apart |= np.abs(offset) - half > reach
        else:
            # Signed distance to the nearer side plane of the pyramid, times the length of its normal
            apart |= np.abs(offset) - half * ahead > reach * np.hypot(1.0, half)
    return np.asarray(apart & (radii > 0.0))


@contextmanager
def without(scene: Any, hidden: NDArray[np.bool_]) -> Iterator[None]:
    """Temporarily hide geoms from a scene. `hidden` is a mask of shape (ngeom,)."""
    geoms = scene.geoms[: scene.ngeom]
    # Geoms that do not belong to the model map to the extra entry at the end, which is False.
    owners = [geom.objid if geom.objtype == _GEOM else -1 for geom in geoms]
    chosen = [geoms[index] for index in np.flatnonzero(np.append(hidden, False)[owners])] if owners else []
    types = [geom.type for geom in chosen]
    try:
        for geom in chosen:
            geom.type = _NOTHING
        yield
    finally:
        for geom, kept in zip(chosen, types, strict=True):
            geom.type = kept
