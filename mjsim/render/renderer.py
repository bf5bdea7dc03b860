"""Frames of a model: in the first person, with depth and segmentation, and from outside.

While a camera outside rests, everything at rest is drawn once.
"""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from mjsim.house.scene.avatar import EYE
from mjsim.render import context
from mjsim.render.cameras import CameraPose, ViewVolume, camera_pose
from mjsim.render.markers import MarkerLike, blend_hidden
from mjsim.render.profiles import RenderProfile, resolve_profile
from mjsim.render.rasteriser import FIRST_PERSON_GROUPS, Layer, Rasteriser

REST = 25  # frames without movement after which something counts as standing still again


@dataclass(frozen=True, eq=False)
class Frame:
    """Images of one moment from one camera, rows from the top; None where not asked for."""

    camera: CameraPose  # where it was seen from
    rgb: NDArray[np.uint8] | None  # colour, uint8, shape (height, width, 3)
    # distance along the optical axis, m, inf where nothing is, float32, shape (height, width)
    depth: NDArray[np.float32] | None
    segmentation: NDArray[np.int32] | None  # geom ids, -1 where nothing is, int32, shape (height, width)


class OffScreenRenderer:
    """Owns the rasteriser of one model. Close it, or use it as a context manager.

    Args:
        model: Compiled model.
        width: Of the frames, pixels.
        height: Of the frames, pixels.
        profile: `draft`, `fast`, `quality` or a custom profile.
        groups: Geom groups that are shown (docs/models.md).

    Raises:
        RenderError: No OpenGL context can be made, or the size or profile is unusable.
    """

    def __init__(
        self,
        model: Any,
        *,
        width: int = 640,
        height: int = 480,
        profile: str | RenderProfile = "fast",
        groups: Collection[int] = FIRST_PERSON_GROUPS,
    ) -> None:
        self._model = model
        self._profile = resolve_profile(profile)
        self._rasteriser = Rasteriser(model, width, height, self._profile, groups)

    def close(self) -> None:
        """Free the GL resources; again does nothing."""
        self._rasteriser.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class Renderer(OffScreenRenderer):
    """Draws a model off screen.

    Any thread may call it; calls take turns. Frames are bit-identical over calls and processes on one OpenGL
    driver (see `gl_info`). Poses are those of the last `mj_forward` or `mj_step` of the data.
    """

    @property
    def width(self) -> int:
        """Of the frames, pixels."""
        return self._rasteriser.size[0]

    @property
    def height(self) -> int:
        """Of the frames, pixels."""
        return self._rasteriser.size[1]

    @property
    def profile(self) -> RenderProfile:
        """Settings in use."""
        return self._profile

    def rgb(
        self, data: Any, camera: str | CameraPose = EYE, markers: Sequence[MarkerLike] = ()
    ) -> NDArray[np.uint8]:
        """Colour image (height, width, 3), contiguous, rows from the top.

        Args:
            data: State of the renderer's model.
            camera: A camera of the model, or a pose.
            markers: World-locked objects to draw; the scene hides them as it hides real ones, except for `x_ray` ones.

        Raises:
            RenderError: Unknown camera, unusable marker, foreign data, or the renderer is closed.
        """
        with context.current_context():
            view = self._look(data, camera)
            return self._rasteriser.colour(view, markers)

    def depth(
        self, data: Any, camera: str | CameraPose = EYE, markers: Sequence[MarkerLike] = ()
    ) -> NDArray[np.float32]:
        """Distance along the optical axis in m, (height, width), inf where nothing is.

        Glass and markers (only those given here) count as solid.

        Raises:
            RenderError: As for `rgb`.
        """
        with context.current_context():
            view = self._look(data, camera)
            return view.metres(self._rasteriser.geometry(view, markers)[1])

    def segmentation(self, data: Any, camera: str | CameraPose = EYE) -> NDArray[np.int32]:
        """Geom id per pixel, (height, width), -1 where nothing is; glass counts as solid.

        Raises:
            RenderError: As for `rgb`.
        """
        with context.current_context():
            return self._rasteriser.geometry(self._look(data, camera))[0]

    def frame(
        self,
        data: Any,
        camera: str | CameraPose = EYE,
        markers: Sequence[MarkerLike] = (),
        *,
        rgb: bool = True,
        depth: bool = False,
        segmentation: bool = False,
    ) -> Frame:
        """Several images of the same moment: one scene update, one pass for depth and segmentation together.

        Markers are drawn into the colour image only.

        Raises:
            RenderError: As for `rgb`.
        """
        (frame,) = self.frames(data, (camera,), markers, rgb=rgb, depth=depth, segmentation=segmentation)
        return frame

    def frames(
        self,
        data: Any,
        cameras: Iterable[str | CameraPose],
        markers: Sequence[MarkerLike] = (),
        *,
        rgb: bool = True,
        depth: bool = False,
        segmentation: bool = False,
    ) -> tuple[Frame, ...]:
        """The same moment from any number of cameras, with one scene update for all.

        Raises:
            RenderError: As for `rgb`.
        """
        poses = [camera_pose(self._model, data, camera, self.width / self.height) for camera in cameras]
        with context.current_context():
            self._rasteriser.update(data)
            return tuple(self._frame(pose, markers, rgb, depth, segmentation) for pose in poses)

    def _frame(
        self, pose: CameraPose, markers: Sequence[MarkerLike], rgb: bool, depth: bool, segmentation: bool
    ) -> Frame:
        view = ViewVolume.of(pose)
        colour = self._rasteriser.colour(view, markers) if rgb else None
        ids, raw = self._rasteriser.geometry(view) if depth or segmentation else (None, None)
        metres = view.metres(raw) if depth and raw is not None else None
        return Frame(pose, colour, metres, ids if segmentation else None)

    def camera_pose(self, data: Any, camera: str | CameraPose = EYE) -> CameraPose:
        """Where a camera of the model is and how wide it sees.

        Raises:
            RenderError: Unknown camera.
        """
        return camera_pose(self._model, data, camera, self.width / self.height)

    def _look(self, data: Any, camera: str | CameraPose) -> ViewVolume:
        self._rasteriser.update(data)
        return ViewVolume.of(camera_pose(self._model, data, camera, self.width / self.height))


class LayeredRenderer(OffScreenRenderer):
    """Draws a model off screen, several times as fast as a `Renderer` while the camera rests.

    What moves, and the markers, are drawn over a picture of the rest by their depth; what comes to rest joins the rest.
    Profiles with shadow maps, mirrors or multisampling are drawn in full, as everything changes everything there; so
    are moving things that one can see through, as they have no depth. What moves behind something shows faintly,
    as x-ray markers do.
    """

    def __init__(self, model: Any, **options: Any) -> None:
        super().__init__(model, **options)
        profile = self._profile
        self._layered = not (profile.shadow_size or profile.reflections or profile.samples)
        self._camera: CameraPose | None = None
        self._translucent = _translucent(model)
        self._still = np.full(model.ngeom, REST)  # frames since each geom moved
        self._poses = np.full((model.ngeom, 12), np.nan)
        self._moving: NDArray[np.bool_] | None = None
        self._rest: Layer | None = None

    def rgb(self, data: Any, camera: CameraPose, markers: Sequence[MarkerLike] = ()) -> NDArray[np.uint8]:
        """Colour image (height, width, 3), rows from the top; the camera rests while it is the same object."""
        with context.current_context():
            self._rasteriser.update(data)
            view, still = ViewVolume.of(camera), camera is self._camera
            self._camera = camera
            if not (self._layered and still) or np.any(self._note_movement(data) & self._translucent):
                self._rest = None
                return self._rasteriser.colour(view, markers)
            rest = self._background(view)
            opaque = [marker for marker in markers if marker.rgba[3] >= 1.0]
            front = self._rasteriser.layer(view, opaque, hidden=~self._moves)
            frame = rest.colour.copy()
            nearer = front.depth > rest.depth
            frame[nearer] = front.colour[nearer]
            blend_hidden(frame, front.colour, rest.depth, front.depth)
            self._blend_translucent(frame, np.maximum(rest.depth, front.depth), view, markers)
            return self._rasteriser.reduced(frame)

    def _blend_translucent(
        self,
        frame: NDArray[np.uint8],
        depth: NDArray[np.float32],
        view: ViewVolume,
        markers: Sequence[MarkerLike],
    ) -> None:
        """Blend markers that one can see through into a drawing in place; drawn as they are they leave no depth."""
        for opacity in sorted({marker.rgba[3] for marker in markers if marker.rgba[3] < 1.0}):
            solid = [_Solid(marker) for marker in markers if marker.rgba[3] == opacity]
            layer = self._rasteriser.layer(view, solid, hidden=np.ones_like(self._translucent))
            nearer = layer.depth > depth
            mixed = frame[nearer] * (1.0 - opacity) + layer.colour[nearer] * opacity
            frame[nearer] = np.round(mixed).astype(np.uint8)

    @property
    def _moves(self) -> NDArray[np.bool_]:
        return self._still < REST

    def _note_movement(self, data: Any) -> NDArray[np.bool_]:
        """Which geoms move, or moved a moment ago, shape (ngeom,)."""
        poses = np.hstack([data.geom_xpos, data.geom_xmat])
        moved = np.any(poses != self._poses, axis=1) & ~np.isnan(self._poses[:, 0])
        self._still = np.where(moved, 0, np.minimum(self._still + 1, REST))
        self._poses = poses
        return self._moves

    def _background(self, view: ViewVolume) -> Layer:
        """Everything at rest; drawn again when something starts or stops moving."""
        moving = self._moves
        if self._rest is None or self._moving is None or np.any(moving != self._moving):
            self._moving = moving
            self._rest = self._rasteriser.layer(view, hidden=moving, lowest=True)
        return self._rest


class _Solid:
    """An opaque copy of a marker."""

    def __init__(self, marker: MarkerLike) -> None:
        self.shape, self.position, self.size = marker.shape, marker.position, marker.size
        self.rgba = (*marker.rgba[:3], 1.0)
        self.x_ray = marker.x_ray


def _translucent(model: Any) -> NDArray[np.bool_]:
    """Which geoms one can see through, shape (ngeom,); they leave no depth."""
    material = model.geom_matid
    opacity = (
        np.where(material >= 0, model.mat_rgba[material, 3], 1.0) if model.nmat else np.ones(model.ngeom)
    )
    return np.asarray((model.geom_rgba[:, 3] < 1.0) | (opacity < 1.0))
