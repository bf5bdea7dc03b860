"""Off-screen renderers: one for colour, depth and segmentation, and a faster one for stationary cameras."""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from mjsim.house.scene.avatar import EYE
from mjsim.render import context
from mjsim.render.cameras import CameraPose, ViewVolume, camera_pose
from mjsim.render.markers import MarkerLike, blend_hidden
from mjsim.render.occlusion import translucent_geoms
from mjsim.render.profiles import RenderProfile, resolve_profile
from mjsim.render.rasteriser import FIRST_PERSON_GROUPS, Layer, Rasteriser, reduced

REST = 25  # number of frames without movement after which a geom counts as stationary


@dataclass(frozen=True, eq=False)
class Frame:
    """The images of one camera at one moment, with the top row first. Images not requested are None."""

    camera: CameraPose
    rgb: NDArray[np.uint8] | None  # colour image, shape (height, width, 3)
    # distance of each pixel along the optical axis in metres, inf for the background, shape (height, width)
    depth: NDArray[np.float32] | None
    segmentation: NDArray[np.int32] | None  # geom id at each pixel or -1, shape (height, width)


class OffScreenRenderer:
    """The base class of renderers. Close a renderer after use, or use it as a context manager.

    Args:
        model: Compiled model.
        width: Width of frames in pixels.
        height: Height of frames in pixels.
        profile: `draft`, `fast`, `quality` or a custom profile.
        groups: Geom groups to draw (docs/models.md).

    Raises:
        RenderError: No OpenGL context can be created, or the size or profile is invalid.
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
        """Free the GL resources. Repeated calls have no effect."""
        self._rasteriser.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class Renderer(OffScreenRenderer):
    """A renderer that draws images of a model off-screen.

    Any thread may use a renderer, but only one thread at a time. Images are bit-identical across calls and
    processes with the same OpenGL driver (see `gl_info`). Call `mj_forward` after changing the data.

    Raises:
        RenderError: Raised by all drawing methods for an unknown camera, an invalid marker, data of another
            model, or a closed renderer.
    """

    @property
    def width(self) -> int:
        """Width of a frame, in pixels."""
        return self._rasteriser.size[0]

    @property
    def height(self) -> int:
        """Height of a frame, in pixels."""
        return self._rasteriser.size[1]

    @property
    def profile(self) -> RenderProfile:
        """The current quality settings."""
        return self._profile

    def rgb(
        self, data: Any, camera: str | CameraPose = EYE, markers: Sequence[MarkerLike] = ()
    ) -> NDArray[np.uint8]:
        """Draw a colour image as a contiguous array of shape (height, width, 3), with the top row first.

        Args:
            data: State of the renderer's model.
            camera: Name of a camera of the model, or a pose.
            markers: Markers to draw. A marker behind a geom is hidden unless it is an x-ray marker.
        """
        with context.current_context():
            return self._rasteriser.colour(self._look(data, camera), markers)

    def depth(
        self, data: Any, camera: str | CameraPose = EYE, markers: Sequence[MarkerLike] = ()
    ) -> NDArray[np.float32]:
        """Draw a depth image (height, width) of distances along the optical axis in metres.

        The background is inf. Glass and markers count as opaque."""
        with context.current_context():
            view = self._look(data, camera)
            return view.metres(self._rasteriser.geometry(view, markers)[1])

    def segmentation(self, data: Any, camera: str | CameraPose = EYE) -> NDArray[np.int32]:
        """Draw an image (height, width) of geom ids, with -1 for the background. Glass counts as opaque."""
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
        """Draw several types of images of the same moment. Depth and segmentation share one pass.

        Markers appear only in the colour image."""
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
        """Draw images of the same moment from several cameras."""
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
        """Return the pose of a camera. Raise a RenderError if the model has no such camera."""
        return camera_pose(self._model, data, camera, self.width / self.height)

    def _look(self, data: Any, camera: str | CameraPose) -> ViewVolume:
        self._rasteriser.update(data)
        return ViewVolume.of(camera_pose(self._model, data, camera, self.width / self.height))


class LayeredRenderer(OffScreenRenderer):
    """An off-screen renderer that is several times as fast as `Renderer` while the camera is stationary.

    It caches an image of the stationary geoms, and draws moving geoms and markers over this image where they
    are nearer. Moving geoms behind other geoms show faintly, like x-ray markers, which have no lines around them
    here. The cache is not used with shadow maps, reflections or multisampling, or while a translucent geom moves.
    """

    def __init__(self, model: Any, **options: Any) -> None:
        super().__init__(model, **options)
        profile = self._profile
        self._layered = not (profile.shadow_size or profile.reflections or profile.samples)
        self._camera: CameraPose | None = None
        self._translucent = translucent_geoms(model)
        self._still = np.full(model.ngeom, REST)  # number of frames since each geom last moved
        self._poses = np.full((model.ngeom, 12), np.nan)
        self._moving: NDArray[np.bool_] | None = None
        self._rest: Layer | None = None

    def rgb(self, data: Any, camera: CameraPose, markers: Sequence[MarkerLike] = ()) -> NDArray[np.uint8]:
        """Draw a colour image (height, width, 3). Pass the same `camera` object until the camera moves."""
        with context.current_context():
            self._rasteriser.update(data)
            view, still = ViewVolume.of(camera), camera is self._camera
            self._camera = camera
            if not (self._layered and still) or np.any(self._detect_movement(data) & self._translucent):
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
            return reduced(frame, self._rasteriser.size)

    def _blend_translucent(
        self,
        frame: NDArray[np.uint8],
        depth: NDArray[np.float32],
        view: ViewVolume,
        markers: Sequence[MarkerLike],
    ) -> None:
        """Blend translucent markers into `frame` in place. Opaque copies are drawn to obtain their depth."""
        for opacity in sorted({marker.rgba[3] for marker in markers if marker.rgba[3] < 1.0}):
            solid = [_Solid(marker) for marker in markers if marker.rgba[3] == opacity]
            layer = self._rasteriser.layer(view, solid, hidden=np.ones_like(self._translucent))
            nearer = layer.depth > depth
            mixed = frame[nearer] * (1.0 - opacity) + layer.colour[nearer] * opacity
            frame[nearer] = np.round(mixed).astype(np.uint8)

    @property
    def _moves(self) -> NDArray[np.bool_]:
        return self._still < REST

    def _detect_movement(self, data: Any) -> NDArray[np.bool_]:
        poses = np.hstack([data.geom_xpos, data.geom_xmat])
        moved = np.any(poses != self._poses, axis=1) & ~np.isnan(self._poses[:, 0])
        self._still = np.where(moved, 0, np.minimum(self._still + 1, REST))
        self._poses = poses
        return self._moves

    def _background(self, view: ViewVolume) -> Layer:
        moving = self._moves
        if self._rest is None or self._moving is None or np.any(moving != self._moving):
            self._moving = moving
            self._rest = self._rasteriser.layer(view, hidden=moving, lowest=True)
        return self._rest


class _Solid:
    def __init__(self, marker: MarkerLike) -> None:
        self.shape, self.position, self.size = marker.shape, marker.position, marker.size
        self.rgba = (*marker.rgba[:3], 1.0)
        self.x_ray = marker.x_ray
