"""The rasteriser, which draws colour images, geom ids and depth images of a model."""

from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple, Self

import cv2
import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.render import context
from mjsim.render.arms import Arms
from mjsim.render.cameras import Bounds, ViewVolume, outside, without
from mjsim.render.markers import MAX_MARKERS, MarkerLike, add_markers, blend_hidden, in_view, outline_hidden
from mjsim.render.occlusion import BoxOccluders
from mjsim.render.profiles import RenderProfile
from mjsim.render.scene_settings import (
    DirectionalLight,
    buffer_settings,
    checked_size,
    set_flags,
    set_lights,
    visual_option,
)
from mjsim.render.shadows import ContactShadows
from mjsim.values.errors import RenderError

CEILING_GROUP = 1  # geom group of ceilings and lamps, which top-down views leave out
FIRST_PERSON_GROUPS = (0, CEILING_GROUP, 2)
TOP_DOWN_GROUPS = (0, 2)

_Flag = mujoco.mjtRndFlag
_BACKGROUND = -1
_FAR_UP = 1e4  # height in metres to which hidden objects are moved so that they cast no contact shadow


class Layer(NamedTuple):
    """An image of a part of a scene at the supersampled size, with the bottom row first."""

    colour: NDArray[np.uint8]  # colour image, shape (h, w, 3)
    depth: NDArray[np.float32]  # reversed depth, 1 at the near plane, 0 for the background, shape (h, w)


class Rasteriser:
    """A rasteriser that draws images of one model.

    `width` and `height` are in pixels. `groups` are the geom groups to draw. `lights` replace those of the
    model. A thread that shares a rasteriser must update and draw in the same `current_context` block.
    """

    def __init__(
        self,
        model: Any,
        width: int,
        height: int,
        profile: RenderProfile,
        groups: Collection[int] = FIRST_PERSON_GROUPS,
        lights: Sequence[DirectionalLight] | None = None,
    ) -> None:
        self._size = checked_size(width), checked_size(height)
        self._profile = profile
        self._lights = lights
        scale = profile.supersampling
        self._drawn = checked_size(round(width * scale)), checked_size(round(height * scale))
        self._option = visual_option(groups, profile)
        shown = np.isin(model.geom_group, list(groups))
        self._arms = Arms(model)
        self._bounds = Bounds.of(model)
        self._bounds.radii[self._arms.sleeves] = 0.0  # a sleeve may become longer, so it is never culled
        self._occluders = BoxOccluders(model, self._bounds, shown)
        self._shadows = ContactShadows(model, shown) if profile.contact_shadows else None
        spots = self._shadows.count if self._shadows else 0
        self._scene = mujoco.MjvScene(model, maxgeom=model.ngeom + MAX_MARKERS + spots)
        self._xray_scene = mujoco.MjvScene(model, maxgeom=MAX_MARKERS)
        self._xray_scene.flags[:] = 0
        self._camera = mujoco.MjvCamera()
        self._model = model
        self._positions, self._rotations = np.zeros((model.ngeom, 3)), np.zeros((model.ngeom, 3, 3))
        self._colour = np.empty((self._drawn[1], self._drawn[0], 3), np.uint8)
        self._ids = np.empty((height, width, 3), np.uint8)
        self._depth = np.empty((height, width), np.float32)
        with (
            context.current_context(),
            buffer_settings(model, self._drawn, profile.samples, profile.shadow_size),
        ):
            self._gl = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_50)
            self._gl.readDepthMap = mujoco.mjtDepthMap.mjDEPTH_ZEROFAR
        self._key: int | None = context.own(self._gl)

    @property
    def size(self) -> tuple[int, int]:
        return self._size

    @property
    def closed(self) -> bool:
        return self._key is None

    def close(self) -> None:
        """Free the GL resources. Repeated calls have no effect."""
        if self._key is not None:
            context.release(self._key)
            self._key = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def update(self, data: Any) -> None:
        """Copy the poses and colours of geoms from `data`. Raise a RenderError for data of another model."""
        if self.closed:
            raise RenderError("the renderer is closed; make a new one")
        if len(data.geom_xpos) != self._model.ngeom or len(data.qpos) != self._model.nq:
            raise RenderError(
                f"data has {len(data.geom_xpos)} geoms and {len(data.qpos)} coordinates, the renderer's model "
                f"{self._model.ngeom} and {self._model.nq}; make a renderer for the model of this data"
            )
        self._positions, self._rotations = data.geom_xpos.copy(), data.geom_xmat.reshape(-1, 3, 3).copy()
        category = mujoco.mjtCatBit.mjCAT_ALL
        mujoco.mjv_updateScene(self._model, data, self._option, None, self._camera, category, self._scene)
        lengths = self._arms.pose(data, self._positions, self._rotations)
        self._arms.place(self._scene, self._positions, self._rotations, lengths)
        if self._lights is not None:
            set_lights(self._scene, self._lights)

    def colour(self, view: ViewVolume, markers: Sequence[MarkerLike] = ()) -> NDArray[np.uint8]:
        """Draw a colour image (height, width, 3) of the latest state, with the top row first."""
        set_flags(self._scene, self._profile)
        with self._aimed(view) as scene:
            if self._shadows is not None:
                self._shadows.add(scene, view, self._aspect, self._positions, self._rotations)
            shown = in_view(view, self._aspect, markers)
            add_markers(scene, shown)
            with context.current_context(), without(scene, self._unseen(view, self._profile)):
                self._draw(scene, self._drawn, self._colour, None)
                self._add_x_ray(view, [marker for marker in shown if marker.x_ray])
        return reduced(self._colour, self._size)

    def geometry(
        self, view: ViewVolume, markers: Sequence[MarkerLike] = ()
    ) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
        """Draw geom ids and reversed depths, both (height, width). The background and markers have id -1."""
        model_geoms = self._scene.ngeom
        self._scene.flags[:] = 0
        for flag in (_Flag.mjRND_SEGMENT, _Flag.mjRND_IDCOLOR, _Flag.mjRND_CULL_FACE):
            self._scene.flags[flag] = 1
        with self._aimed(view) as scene:
            add_markers(scene, markers)
            geoms = scene.geoms[: scene.ngeom]
            for index in range(model_geoms, scene.ngeom):
                # MuJoCo draws the ids as colours, and would not draw a geom without an id.
                geoms[index].segid = index
            kind = mujoco.mjtObj.mjOBJ_GEOM
            owners = [_BACKGROUND] + [g.objid if g.objtype == kind else _BACKGROUND for g in geoms]
            table = np.array(owners, dtype=np.int32)
            with context.current_context(), without(scene, self._unseen(view)):
                self._draw(scene, self._size, self._ids, self._depth)
        packed = cv2.flip(self._ids, 0).astype(np.int32)
        ids = table[packed[..., 0] | packed[..., 1] << 8 | packed[..., 2] << 16]
        return ids, np.asarray(cv2.flip(self._depth, 0), dtype=np.float32)

    def layer(
        self,
        view: ViewVolume,
        markers: Sequence[MarkerLike] = (),
        *,
        hidden: NDArray[np.bool_],
        lowest: bool = False,
    ) -> Layer:
        """Draw the scene without `hidden` geoms. Only the `lowest` layer contains sky and contact shadows."""
        set_flags(self._scene, self._profile)
        self._scene.flags[_Flag.mjRND_SKYBOX] &= lowest
        layer = Layer(np.empty_like(self._colour), np.empty(self._colour.shape[:2], np.float32))
        with self._aimed(view) as scene:
            if lowest and self._shadows is not None:
                away = np.where(hidden[:, None], _FAR_UP, self._positions)
                self._shadows.add(scene, view, self._aspect, away, self._rotations)
            add_markers(scene, in_view(view, self._aspect, markers))
            with without(scene, hidden | self._unseen(view, self._profile)):
                self._draw(scene, self._drawn, layer.colour, layer.depth)
        return layer

    @contextmanager
    def _aimed(self, view: ViewVolume) -> Iterator[Any]:
        """Aim the scene at a view, and remove the geoms that were added to it afterwards."""
        geoms = self._scene.ngeom
        view.aim(self._scene)
        try:
            yield self._scene
        finally:
            self._scene.ngeom = geoms

    @property
    def _aspect(self) -> float:
        # Because sizes are rounded, the drawing and the frame may have different aspect ratios.
        return max(width / height for width, height in (self._size, self._drawn))

    def _unseen(self, view: ViewVolume, profile: RenderProfile | None = None) -> NDArray[np.bool_]:
        if profile is not None and (profile.shadow_size or profile.reflections):
            return np.zeros(self._model.ngeom, dtype=bool)
        aspect = self._aspect
        unseen = outside(view, aspect, self._positions, self._bounds.radii)
        return unseen | self._occluders.unseen(view, aspect, self._positions, self._rotations, ~unseen)

    def _draw(
        self,
        scene: Any,
        size: tuple[int, int],
        colour: NDArray[np.uint8] | None,
        depth: NDArray[np.float32] | None,
    ) -> None:
        rectangle = mujoco.MjrRect(0, 0, *size)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._gl)
        mujoco.mjr_render(rectangle, scene, self._gl)
        mujoco.mjr_readPixels(colour, depth, rectangle, self._gl)

    def _add_x_ray(self, view: ViewVolume, markers: Sequence[MarkerLike]) -> None:
        if not markers:
            return
        scene_depth, marker_depth = np.empty((2, *self._colour.shape[:2]), np.float32)
        mujoco.mjr_readPixels(None, scene_depth, mujoco.MjrRect(0, 0, *self._drawn), self._gl)
        scene = self._xray_scene
        scene.ngeom = 0
        add_markers(scene, markers, flat=True)
        view.aim(scene)
        colour = np.empty_like(self._colour)
        self._draw(scene, self._drawn, colour, marker_depth)
        blend_hidden(self._colour, colour, scene_depth, marker_depth)
        outline_hidden(self._colour, scene_depth, marker_depth)


def reduced(drawn: NDArray[np.uint8], size: tuple[int, int]) -> NDArray[np.uint8]:
    """Scale a drawing to `size` (width, height), and flip it so that the top row is first."""
    if drawn.shape[1::-1] == size:
        return np.asarray(cv2.flip(drawn, 0), dtype=np.uint8)
    # For small reductions, linear interpolation is three times as fast as area averaging and looks similar.
    slight = drawn.shape[1] < 1.5 * size[0]
    method = cv2.INTER_LINEAR_EXACT if slight else cv2.INTER_AREA
    return np.asarray(cv2.flip(cv2.resize(drawn, size, interpolation=method), 0), dtype=np.uint8)
