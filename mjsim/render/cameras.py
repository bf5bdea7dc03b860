"""Camera poses, view volumes, and culling of geoms outside the view."""

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

# Distances from the eye to the clipping planes, in metres. The eye is never closer than `NEAR` to a surface.
NEAR = 0.04
FAR = 100.0
_MARGIN = 0.01  # culling tolerance in metres, much larger than single-precision rounding errors
_NOTHING = int(mujoco.mjtGeom.mjGEOM_NONE)  # geom type that MuJoCo does not draw
# Converted to an integer, because comparing a value with an enumeration member takes ten times as long.
_GEOM = int(mujoco.mjtObj.mjOBJ_GEOM)


@dataclass(frozen=True, eq=False)
class CameraPose:
    """The position, orientation and field of view of a pinhole camera."""

    position: NDArray[np.float64]  # position of the eye in the house frame, in metres, shape (3,)
    # rotation matrix, shape (3, 3), whose columns are the right, up and backward axes in the house frame
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
    """Return the rotation matrix (3, 3) of an upright camera that looks along `direction`.

    If the direction is vertical, the top of the image points towards +y.
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
    """The region of space that a camera shows, as a pyramid or (if orthographic) a box."""

    position: NDArray[np.float64]  # position of the eye in metres, shape (3,)
    rotation: NDArray[np.float64]  # right, up and backward axes of the camera as columns, shape (3, 3)
    half_height: float  # half the height of the view in metres; in perspective views, 1 m from the eye
    near: float = NEAR  # distance from the eye to the near clipping plane, in metres
    far: float = FAR  # distance from the eye to the far clipping plane, in metres
    orthographic: bool = False

    @classmethod
    def of(cls, pose: CameraPose) -> "ViewVolume":
        return cls(pose.position, pose.rotation, float(np.tan(pose.fovy / 2)))

    def metres(self, raw: NDArray[np.float32]) -> NDArray[np.float32]:
        """Convert reversed depths (1 near, 0 far) to distances along the optical axis, in metres."""
        depth = np.divide(self.near * self.far, self.near + raw.astype(np.float64) * (self.far - self.near))
        if self.orthographic:
            depth = self.far - raw.astype(np.float64) * (self.far - self.near)
        depth[raw <= 0.0] = np.inf
        return depth.astype(np.float32)

    def aim(self, scene: Any) -> None:
        top = self.half_height if self.orthographic else self.half_height * self.near
        forward = -self.rotation[:, 2]
        for camera in scene.camera:  # without stereo, MuJoCo uses the average of a scene's two cameras
            camera.pos, camera.forward, camera.up = self.position, forward, self.rotation[:, 1]
            camera.frustum_center, camera.frustum_width = 0.0, 0.0
            camera.frustum_bottom, camera.frustum_top = -top, top
            camera.frustum_near, camera.frustum_far = self.near, self.far
            camera.orthographic = int(self.orthographic)
        for light in scene.lights[: scene.nlight]:
            if light.headlight:
                light.pos, light.dir = self.position, forward


def camera_pose(model: Any, data: Any, camera: str | CameraPose, aspect: float) -> CameraPose:
    """Return the pose of a camera of the model. If `camera` already is a pose, return it unchanged.

    `aspect` is the width of the image divided by its height. The eye camera keeps the person's horizontal
    field of view at every aspect ratio, and other cameras keep their vertical one. Raises a RenderError for
    an unknown camera.
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
    """The bounding sphere and the bounding box of each geom in a model, in the geom's own frame."""

    # radius of the sphere around each geom's origin in metres, 0 if the geom is unbounded, shape (ngeom,)
    radii: NDArray[np.float64]
    boxes: NDArray[np.float64]  # centre and half sizes of each bounding box in metres, shape (ngeom, 6)

    @classmethod
    def of(cls, model: Any) -> "Bounds":
        """Compute the bounds of a model's geoms. Unlike in MuJoCo, planes of finite size have bounds."""
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
    """Return a mask (n,) of the spheres outside a view. It may miss some near the corners of the view.

    Spheres of radius 0 count as unbounded, and are never outside.
    """
    right, up, backward = ((centres - view.position) @ view.rotation).T
    ahead, reach = -backward, radii + _MARGIN
    vertical, horizontal = view.half_height, view.half_height * aspect
    apart = (ahead + reach < view.near) | (ahead - reach > view.far)
    for offset, half in ((right, horizontal), (up, vertical)):
        if view.orthographic:
            apart |= np.abs(offset) - half > reach
        else:
            # Signed distance to the nearer side plane of the pyramid, times the length of the plane's normal
            apart |= np.abs(offset) - half * ahead > reach * np.hypot(1.0, half)
    return np.asarray(apart & (radii > 0.0))


@contextmanager
def without(scene: Any, hidden: NDArray[np.bool_]) -> Iterator[None]:
    """Hide geoms of a scene for the duration of a `with` block. `hidden` is a mask of shape (ngeom,)."""
    geoms = scene.geoms[: scene.ngeom]
    # Geoms that do not belong to the model use the extra entry at the end of the mask, which is False.
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
