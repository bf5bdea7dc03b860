"""Films from outside: while the camera rests, everything at rest is drawn once."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjsim.render import context
from mjsim.render.cameras import CameraPose, ViewVolume
from mjsim.render.markers import MarkerLike, blend_hidden
from mjsim.render.rasteriser import Layer
from mjsim.render.renderer import OffScreenRenderer

REST = 25  # frames without movement after which something counts as standing still again


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
