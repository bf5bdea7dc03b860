"""Classes and functions that draw the HUD or captions over frames."""

import dataclasses
import functools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hud import minimap as maps
from hud import panels, theme
from hud.canvas import Canvas, Patch, Rect
from hud.errors import FrameError
from hud.layout import Layout, arrange, pointer_rect, unit_of
from hud.state import FLOORPLAN, HudState, MiniMap
from hud.stencils import Pictures, Stencils
from hud.texts import HudTexts, filled
from hud.theme import POINTER

Draw = Callable[..., Patch]


class Compositor:
    """A compositor that draws HUD states over frames. It redraws a panel only if its content has changed.

    Args:
        pictures: RGBA pictures by key, as uint8 of shape (s, s, 4) with straight alpha. Only the floor plan
            may have another shape. The arrays must not be modified later.
        texts: Texts of the HUD.
        beside: True if the panels are next to the picture, which is at `picture_rect` in each frame.

    Raises:
        FrameError: A picture has the wrong shape or type.
    """

    def __init__(self, pictures: Pictures, texts: HudTexts, *, beside: bool = False) -> None:
        for key, picture in pictures.items():
            sized = picture.ndim == 3 and min(picture.shape) > 0 and picture.shape[2] == 4
            square = sized and (picture.shape[0] == picture.shape[1] or key == FLOORPLAN)
            if picture.dtype != np.uint8 or not square:
                raise FrameError(
                    f"picture {key!r} must be uint8 (s, s, 4), got {picture.dtype} {picture.shape}"
                )
        self._stencils = Stencils(dict(pictures), 1.0)
        self._texts = texts
        self._beside = beside
        self._layout: tuple[object, Layout] | None = None
        self._patches: dict[str, tuple[object, Patch]] = {}

    def compose(self, frame: NDArray[np.uint8], state: HudState) -> NDArray[np.uint8]:
        """Return a copy of a frame with the HUD drawn over it. The markers are drawn by the renderer.

        Args:
            frame: RGB image as uint8 of shape (H, W, 3), at least 320 pixels wide and 240 high.
            state: HUD state to draw.

        Raises:
            FrameError: The frame has the wrong shape or type, or is too small.
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
        """Return the layout of a HUD state's panels in a frame of the given size in pixels."""
        unit = unit_of(width, height, beside=self._beside)
        if self._stencils.unit != unit:
            self._stencils = Stencils(self._stencils.pictures, unit)
            self._patches.clear()
        key = (width, height, _without_motion(state))
        if self._layout is None or self._layout[0] != key:
            arranged = arrange(key[2], width, height, self._stencils.typeface, beside=self._beside)
            self._layout = (key, arranged)
        found = self._layout[1]
        if state.pointer is None:
            return found
        pointer = pointer_rect(state.pointer.angle, found.free, round(POINTER * unit))
        return dataclasses.replace(found, panels={**found.panels, "pointer": pointer})

    def _patch(self, name: str, draw: Draw, *what: object) -> Patch:
        known = self._patches.get(name)
        if known is None or known[0] != what:
            known = self._patches[name] = (what, draw(self._stencils, *what))
        return known[1]


def compose(
    frame: NDArray[np.uint8], state: HudState, pictures: Pictures, texts: HudTexts
) -> NDArray[np.uint8]:
    """Return a copy of a frame with the HUD drawn over it. For many frames, a `Compositor` is faster.

    Raises FrameError if the frame or a picture has the wrong shape or type, or the frame is too small.
    """
    return Compositor(pictures, texts).compose(frame, state)


def _without_motion(state: HudState) -> HudState:
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
    hidden = panels.hidden_text(layout.first, len(state.checklist) - layout.stop, texts)
    header = (state.checklist_title, panels.count_text(state.checklist, texts))
    bins = state.bins[: len(layout.bin_rows)]
    more = len(state.bins) - len(bins)
    title = filled(texts.more_bins, count=more) if more else texts.bins
    found: dict[str, tuple[Any, ...]] = {
        "progress": (panels.draw_progress, state.delivered, state.total),
        "checklist": (
            panels.draw_checklist,
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


class Captions:
    """Captions at the bottom of frames of a fixed size. Each caption has a title and a line of detail."""

    def __init__(self, width: int, height: int) -> None:
        self._size = (width, height)
        self._stencils = Stencils({}, unit_of(width, height))
        self._patch = functools.lru_cache(64)(self._draw)

    def over(self, frame: NDArray[np.uint8], title: str, detail: str = "") -> NDArray[np.uint8]:
        """Return a copy of an RGB frame (uint8, shape (height, width, 3)) with a caption drawn over it."""
        width, height = self._size
        if frame.shape != (height, width, 3):
            raise FrameError(f"frame must be of shape {(height, width, 3)}, got {frame.shape}")
        out = np.array(frame, dtype=np.uint8, order="C", copy=True)
        patch = self._patch(title, detail)
        rows, columns = patch.keep.shape[:2]
        bottom = height - self._stencils.typeface.px(2 * theme.MARGIN)
        patch.lay_over(out, (width - columns) // 2, bottom - rows)
        return out

    def _draw(self, title: str, detail: str) -> Patch:
        typeface = self._stencils.typeface
        px, room = typeface.px, self._size[0] - typeface.px(6 * theme.MARGIN)
        first, second = typeface.fit(title, theme.CHIP, room), typeface.fit(detail, theme.BAR, room)
        text_width = max(typeface.width(first, theme.CHIP), typeface.width(second, theme.BAR))
        height = px(2 * theme.PADDING + theme.LINE * (2.4 if second else 1.2))
        canvas = Canvas.panel(self._stencils, Rect(0, 0, text_width + px(4 * theme.PADDING), height))
        canvas.text(px(2 * theme.PADDING), px(theme.PADDING + 13), first, theme.CHIP, theme.TEXT)
        canvas.text(px(2 * theme.PADDING), px(theme.PADDING + 31), second, theme.BAR, theme.QUIET)
        return canvas.patch()
