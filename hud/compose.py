"""Lay the HUD over a frame."""

import dataclasses
import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from hud import checklist, panels
from hud.canvas import Patch, Rect
from hud.errors import FrameError
from hud.layout import Layout, arrange, pointer_rect
from hud.minimap import Kind, draw_base, draw_mark, marks
from hud.options.minimap import FLOORPLAN
from hud.pen import Pen
from hud.state import HudState, MiniMap
from hud.stencils import Pictures, Stencils

POINTER_STEPS = 72  # drawn directions of the pointer, 5 degrees apart


class Compositor:
    """Draws HUD states over frames and remembers the panels that it drew last.

    The result depends on the arguments alone; the memory (one entry per panel) only saves time.

    Args:
        pictures: RGBA pictures, uint8 (s, s, 4), straight alpha, by the keys of states; the floor plan may be any
            rectangle. Must not change.

    Raises:
        FrameError: A picture has another shape or type.
    """

    def __init__(self, pictures: Pictures) -> None:
        for key, picture in pictures.items():
            sized = picture.ndim == 3 and min(picture.shape) > 0 and picture.shape[2] == 4
            square = sized and (picture.shape[0] == picture.shape[1] or key == FLOORPLAN)
            if picture.dtype != np.uint8 or not square:
                raise FrameError(
                    f"picture {key!r} must be uint8 (s, s, 4), got {picture.dtype} {picture.shape}"
                )
        self._stencils = Stencils(dict(pictures))
        self._pen = Pen(self._stencils, 1.0)
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
        out = np.array(frame, dtype=np.uint8, order="C", copy=True)
        if self._pen.unit != layout.unit:
            self._pen = Pen(self._stencils, layout.unit)
        pen = self._pen
        for name, rect in layout.panels().items():
            key, draw = _part(name, rect, state, layout)
            patch = self._patch(name, (layout.unit, rect.width, rect.height, key), draw, pen)
            if name == "message" and state.message is not None and state.message.opacity < 1.0:
                patch = patch.faded(state.message.opacity)
            patch.lay_over(out, rect.x, rect.y)
        if state.minimap is not None and layout.minimap is not None:
            for mark in marks(layout.minimap, state.minimap, layout.unit):
                stamp = self._stamp(mark.kind, mark.step, pen)
                stamp.lay_over(out, mark.x, mark.y)
        return out

    def layout(self, state: HudState, width: int, height: int) -> Layout:
        """Where the panels of `state` go in a frame of this size.

        Raises:
            FrameError: The frame is too small.
        """
        key = (width, height, _without_what_moves(state))
        if self._layout is None or self._layout[0] != key:
            self._layout = (key, arrange(key[2], width, height, self._stencils.face))
        found = self._layout[1]
        if state.pointer is None:
            return found
        return dataclasses.replace(found, pointer=pointer_rect(state.pointer.angle, found.free, found.unit))

    def _stamp(self, kind: Kind, step: int, pen: Pen) -> Patch:
        return self._patch(f"{kind} {step}", pen.unit, lambda pen: draw_mark(pen, kind, step), pen)

    def _patch(self, name: str, key: object, draw: Callable[[Pen], Patch], pen: Pen) -> Patch:
        known = self._patches.get(name)
        if known is None or known[0] != key:
            known = (key, draw(pen))
            self._patches[name] = known
        return known[1]


def compose(frame: NDArray[np.uint8], state: HudState, pictures: Pictures) -> NDArray[np.uint8]:
    """One frame with the HUD on top; for many frames keep a `Compositor`.

    Args:
        frame: RGB, uint8, shape (H, W, 3), at least 320 x 240; not changed.
        state: What to show.
        pictures: RGBA pictures, uint8 (s, s, 4), by the keys that the state uses.

    Raises:
        FrameError: The frame or a picture has another shape or type, or the frame is too small.
    """
    return Compositor(pictures).compose(frame, state)


def _without_what_moves(state: HudState) -> HudState:
    """The state less what changes from frame to frame without moving a panel."""
    shown = state.message is not None and state.message.opacity > 0.0
    return dataclasses.replace(
        state,
        markers=(),
        clock=None if state.clock is None else 0.0,
        delivered=0,
        message=dataclasses.replace(state.message, opacity=1.0)
        if state.message is not None and shown
        else None,
        pointer=None,
        minimap=None if state.minimap is None else MiniMap("", state.minimap.bounds, (0.0, 0.0), 0.0),
    )


def _part(name: str, rect: Rect, state: HudState, layout: Layout) -> tuple[object, Callable[[Pen], Patch]]:
    """What the panel `name` depends on, and how to draw it."""
    if name == "checklist":
        items = state.checklist[layout.first : layout.stop]
        hidden = (layout.first, len(state.checklist) - layout.stop)
        args = (state.checklist_title, items, layout.rows, hidden, checklist.count_text(state.checklist))
        return args, lambda pen: checklist.draw_checklist(pen, rect, *args)
    if name == "bins":
        shown, more = state.bins[: len(layout.bin_rows)], len(state.bins) - len(layout.bin_rows)
        return (shown, more), lambda pen: panels.draw_bins(pen, rect, shown, layout.bin_rows, more)
    if name == "inventory":
        return state.inventory, lambda pen: panels.draw_inventory(pen, rect, state.inventory)
    if name == "message" and (message := state.message) is not None:
        lines = layout.message_lines
        return (message.kind, lines), lambda pen: panels.draw_message(pen, rect, message, lines)
    if name == "progress":
        counts = (state.delivered, state.total)
        return counts, lambda pen: panels.draw_progress(pen, rect, *counts)
    if name == "minimap" and (minimap := state.minimap) is not None:
        base = (minimap.picture, minimap.bounds)
        return base, lambda pen: draw_base(pen, rect, *base)
    if name == "clock" and state.clock is not None:
        text = panels.clock_text(state.clock)
        return text, lambda pen: panels.draw_clock(pen, rect, text)
    angle = 0.0 if state.pointer is None else state.pointer.angle
    step = round(angle / (2.0 * math.pi) * POINTER_STEPS) % POINTER_STEPS
    return step, lambda pen: panels.draw_pointer(pen, rect, 2.0 * math.pi * step / POINTER_STEPS)
