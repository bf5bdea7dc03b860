"""Lay the HUD over a frame."""

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hud import minimap as maps
from hud import panels
from hud.canvas import Patch, Rect
from hud.checklist import count_text, draw_checklist, hidden_text
from hud.errors import FrameError
from hud.layout import Layout, arrange, pointer_rect, unit_of
from hud.options.minimap import FLOORPLAN
from hud.state import HudState, MiniMap
from hud.stencils import Pictures, Stencils
from hud.texts import HudTexts, filled
from hud.theme import POINTER

Draw = Callable[..., Patch]


class Compositor:
    """Draws HUD states over frames, and keeps each panel until what it says has changed.

    The result depends on the arguments alone; what is kept only saves time.

    Args:
        pictures: RGBA pictures, uint8 (s, s, 4), straight alpha, by the keys of states; the floor plan may be any
            rectangle. Must not change.
        texts: Words of the HUD.

    Raises:
        FrameError: A picture has another shape or type.
    """

    def __init__(self, pictures: Pictures, texts: HudTexts) -> None:
        for key, picture in pictures.items():
            sized = picture.ndim == 3 and min(picture.shape) > 0 and picture.shape[2] == 4
            square = sized and (picture.shape[0] == picture.shape[1] or key == FLOORPLAN)
            if picture.dtype != np.uint8 or not square:
                raise FrameError(
                    f"picture {key!r} must be uint8 (s, s, 4), got {picture.dtype} {picture.shape}"
                )
        self._stencils = Stencils(dict(pictures), 1.0)
        self._texts = texts
        self._layout: tuple[object, Layout] | None = None
        self._patches: dict[str, tuple[object, Patch]] = {}

    def compose(self, frame: NDArray[np.uint8], state: HudState) -> NDArray[np.uint8]:
        """A copy of `frame` with the HUD on top.

        Args:
            frame: RGB, uint8, shape (H, W, 3), at least 320 x 240; not changed.
            state: What to show. Its markers are part of the world, drawn by the renderer.

        Returns:
            RGB, uint8, shape (H, W, 3).

        Raises:
            FrameError: The frame has another shape or type, or is too small.
        """
        if frame.ndim != 3 or frame.shape[2] != 3 or frame.dtype != np.uint8:
            raise FrameError(f"frame must be uint8 (H, W, 3), got {frame.dtype} {frame.shape}")
        layout = self.layout(state, frame.shape[1], frame.shape[0])
        contents = _contents(state, layout, self._texts)
        out = np.array(frame, dtype=np.uint8, order="C", copy=True)
        for name, rect in layout.panels.items():
            draw, *what = contents[name]
            patch = self._patch(name, draw, Rect(0, 0, rect.width, rect.height), *what)
            if name == "message" and state.message is not None and state.message.opacity < 1.0:
                patch = patch.faded(state.message.opacity)
            patch.lay_over(out, rect.x, rect.y)
        if state.minimap is not None:
            for mark in maps.marks(layout.panels["minimap"], state.minimap, self._stencils.unit):
                stamp = self._patch(f"{mark.kind} {mark.step}", maps.draw_mark, mark.kind, mark.step)
                stamp.lay_over(out, mark.x, mark.y)
        return out

    def layout(self, state: HudState, width: int, height: int) -> Layout:
        """Where the panels of `state` go in a frame of `width` x `height` px."""
        unit = unit_of(width, height)
        if self._stencils.unit != unit:
            self._stencils = Stencils(self._stencils.pictures, unit)
            self._patches.clear()
        key = (width, height, _without_what_moves(state))
        if self._layout is None or self._layout[0] != key:
            self._layout = (key, arrange(key[2], width, height, self._stencils.typeface))
        found = self._layout[1]
        if state.pointer is None:
            return found
        pointer = pointer_rect(state.pointer.angle, found.free, round(POINTER * unit))
        return dataclasses.replace(found, panels={**found.panels, "pointer": pointer})

    def _patch(self, name: str, draw: Draw, *what: object) -> Patch:
        """What `draw` makes of `what`; the one drawn last under this name if it is the same."""
        known = self._patches.get(name)
        if known is None or known[0] != what:
            known = self._patches[name] = (what, draw(self._stencils, *what))
        return known[1]


def compose(
    frame: NDArray[np.uint8], state: HudState, pictures: Pictures, texts: HudTexts
) -> NDArray[np.uint8]:
    """One frame with the HUD on top; for many frames keep a `Compositor`.

    Args:
        frame: RGB, uint8, shape (H, W, 3), at least 320 x 240; not changed.
        state: What to show.
        pictures: RGBA pictures, uint8 (s, s, 4), by the keys that the state uses.
        texts: Words of the HUD.

    Raises:
        FrameError: The frame or a picture has another shape or type, or the frame is too small.
    """
    return Compositor(pictures, texts).compose(frame, state)


def _without_what_moves(state: HudState) -> HudState:
    """The state less what changes from frame to frame without moving a panel."""
    message = state.message
    if message is not None:
        message = dataclasses.replace(message, opacity=1.0) if message.opacity > 0.0 else None
    return dataclasses.replace(
        state,
        markers=(),
        rerouted=False,
        clock=None if state.clock is None else 0.0,
        delivered=0,
        message=message,
        pointer=None,
        minimap=None if state.minimap is None else MiniMap("", state.minimap.bounds, (0.0, 0.0), 0.0),
    )


def _contents(state: HudState, layout: Layout, texts: HudTexts) -> dict[str, tuple[Any, ...]]:
    """By panel: the function that draws it, and what it takes besides stencils and rectangle."""
    hidden = hidden_text(layout.first, len(state.checklist) - layout.stop, texts)
    header = (state.checklist_title, count_text(state.checklist, texts))
    bins = state.bins[: len(layout.bin_rows)]
    more = len(state.bins) - len(bins)
    title = filled(texts.more_bins, count=more) if more else texts.bins
    found: dict[str, tuple[Any, ...]] = {
        "progress": (panels.draw_progress, state.delivered, state.total),
        "checklist": (
            draw_checklist,
            header,
            state.checklist[layout.first : layout.stop],
            layout.rows,
            hidden,
        ),
        "bins": (panels.draw_bins, title, bins, layout.bin_rows),
        "inventory": (
            panels.draw_inventory,
            state.inventory,
            (texts.left_hand, texts.right_hand),
            texts.empty,
        ),
    }
    if state.message is not None:
        found["message"] = (panels.draw_message, state.message.kind, layout.message_lines)
    if state.clock is not None:
        found["clock"] = (panels.draw_clock, panels.clock_text(state.clock))
    if state.minimap is not None:
        found["minimap"] = (maps.draw_base, state.minimap.picture, state.minimap.bounds)
    if state.pointer is not None:
        step = round(state.pointer.angle / (2.0 * math.pi) * panels.POINTER_STEPS) % panels.POINTER_STEPS
        found["pointer"] = (panels.draw_pointer, step)
    return found
