"""The pinhole projection of the eye camera, and pointers to goals outside the view."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hud.errors import FrameError
from hud.state import Pointer, Vec3

_IDENTITY, _ROUNDING = np.eye(3), 1e-6
NEAR = 1e-6  # depth below which points count as behind the eye, in metres


@dataclass(frozen=True, eq=False)
class CameraView:
    """A pinhole camera with square pixels and its principal point at the image centre.

    Raises:
        FrameError: A shape or a number is invalid.
    """

    position: NDArray[np.float64]  # position of the eye in metres, shape (3,)
    # rotation matrix (3, 3) whose columns are the right, up and backward axes of the camera
    rotation: NDArray[np.float64]
    fovy: float  # vertical field of view in radians
    width: int  # image width in pixels
    height: int  # image height in pixels

    def __post_init__(self) -> None:
        if np.shape(self.position) != (3,) or np.shape(self.rotation) != (3, 3):
            raise FrameError(
                f"camera needs position (3,) and rotation (3, 3), got {np.shape(self.position)} and "
                f"{np.shape(self.rotation)}"
            )
        if not (np.abs(np.transpose(self.rotation) @ self.rotation - _IDENTITY) <= _ROUNDING).all():
            raise FrameError(f"camera rotation must be orthonormal, got {np.asarray(self.rotation).tolist()}")
        if not 0.0 < self.fovy < math.pi or self.width < 1 or self.height < 1:
            raise FrameError(
                f"camera needs 0 < fovy < pi and a positive image size, got fovy {self.fovy}, "
                f"{self.width} x {self.height}"
            )

    @property
    def focal(self) -> float:
        """The focal length in pixels."""
        return self.height / 2.0 / math.tan(self.fovy / 2.0)

    def to_eye(self, points: ArrayLike) -> NDArray[np.float64]:
        """Transform points (..., 3) in metres from the house frame to the eye frame (right, up, forward)."""
        local = (np.asarray(points, dtype=np.float64) - self.position) @ self.rotation
        return np.asarray(local * np.array([1.0, 1.0, -1.0]), dtype=np.float64)


def project(camera: CameraView, points: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the pixel coordinates (n, 2) and the depths (n,) in metres of points (n, 3).

    Pixel coordinates start at the upper left corner of the image. They are NaN for points behind the eye.
    """
    local = camera.to_eye(np.reshape(np.asarray(points, dtype=np.float64), (-1, 3)))
    depth = local[:, 2]
    ahead = depth > NEAR
    scale = camera.focal / np.where(ahead, depth, 1.0)
    pixels = np.stack(
        [camera.width / 2.0 + local[:, 0] * scale, camera.height / 2.0 - local[:, 1] * scale], axis=1
    )
    pixels[~ahead] = np.nan
    return pixels, depth


def in_view(camera: CameraView, point: Vec3, margin: float = 0.0) -> bool:
    """Return True if a point is in the image and at least `margin` times the image height from its edges."""
    pixels, _ = project(camera, [point])
    x, y = pixels[0]
    inset = margin * camera.height
    # Points behind the eye have NaN pixels, with which all comparisons are false.
    return bool(inset <= x <= camera.width - inset and inset <= y <= camera.height - inset)


def pointer_to(camera: CameraView, target: Vec3, margin: float = 0.02) -> Pointer | None:
    """Return the pointer that shows the way to a target, or None because a target in view needs no pointer.

    A target is in view if it is at least `margin` times the image height from the edge of the image.
    """
    if in_view(camera, target, margin):
        return None
    right, up, forward = (float(v) for v in camera.to_eye(target))
    if forward <= 0.0:
        # The target is behind the person, so the pointer shows in which direction to turn.
        return Pointer(angle=0.0 if right >= 0.0 else math.pi)
    return Pointer(angle=math.atan2(up, right))
