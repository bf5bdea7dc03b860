"""Where each panel goes; nothing overlaps.

progress        message bar         clock
task list                            bins
  ...             (free view)         ...
  ...              inventory          mini-map
"""

import math
from dataclasses import dataclass

from hud.canvas import Rect
from hud.errors import FrameError
from hud.measure import Measure
from hud.rows import CHIP_HEIGHT, CHIP_WIDTH, POINTER, SMALLEST, BinRow, ListRow
from hud.state import HudState
from hud.text import Typeface


@dataclass(frozen=True)
class Layout:
    """Rectangles of the panels in a frame, and what fits into them.

    Attributes:
        unit: Frame px per theme px.
        checklist: Task list, or None when it is empty.
        first: Index of the first row shown.
        stop: One past the last row shown.
        rows: Those rows.
        message_lines: The message, broken into lines.
        bin_rows: One per bin that is shown.
        free: The part of the view between the panels.
    """

    width: int
    height: int
    unit: float
    progress: Rect | None
    clock: Rect | None
    message: Rect | None
    checklist: Rect | None
    bins: Rect | None
    inventory: Rect
    pointer: Rect | None
    free: Rect
    first: int
    stop: int
    rows: tuple[ListRow, ...]
    message_lines: tuple[str, ...]
    bin_rows: tuple[BinRow, ...]
    minimap: Rect | None = None

    def panels(self) -> dict[str, Rect]:
        """Rectangles of the panels that are shown, by name."""
        names = ("progress", "clock", "message", "checklist", "bins", "inventory", "minimap", "pointer")
        return {name: rect for name in names if (rect := getattr(self, name)) is not None}


def unit_of(width: int, height: int) -> float:
    """Frame px per theme px: the frame always has room for 640 x 480 theme px.

    Raises:
        FrameError: The frame is too small to be read.
    """
    if width < SMALLEST[0] or height < SMALLEST[1]:
        raise FrameError(
            f"frame of {width} x {height} px is too small for the HUD; use {SMALLEST[0]} x {SMALLEST[1]}"
        )
    return min(width / 640.0, height / 480.0)


def arrange(state: HudState, width: int, height: int, face: Typeface) -> Layout:
    """Lay out the panels of `state` in a frame of `width` x `height` px.

    Raises:
        FrameError: The frame is too small to be read.
    """
    unit = unit_of(width, height)
    panels = Measure(width, height, unit, face)
    checklist, first, rows = panels.checklist(state)
    minimap = panels.minimap(state.minimap)
    bins, bin_rows = panels.bins(state, minimap)
    progress = Rect(panels.margin, panels.margin, panels.px(CHIP_WIDTH), panels.px(CHIP_HEIGHT))
    clock = Rect(
        width - panels.margin - panels.px(CHIP_WIDTH), panels.margin, progress.width, progress.height
    )
    inventory = panels.inventory()
    message, lines = panels.message(state.message)
    free = panels.free(inventory)
    return Layout(
        width=width,
        height=height,
        unit=unit,
        progress=progress if state.total > 0 else None,
        clock=clock if state.clock is not None else None,
        message=message,
        checklist=checklist,
        bins=bins,
        inventory=inventory,
        pointer=None if state.pointer is None else pointer_rect(state.pointer.angle, free, unit),
        free=free,
        first=first,
        stop=first + len(rows),
        rows=rows,
        message_lines=lines,
        bin_rows=bin_rows,
        minimap=minimap,
    )


def pointer_rect(angle: float, free: Rect, unit: float) -> Rect:
    """A square at the edge of the free view in direction `angle`, rad, counter-clockwise from the right."""
    side = round(POINTER * unit)
    half_width, half_height = (free.width - side) / 2.0, (free.height - side) / 2.0
    dx, dy = math.cos(angle), -math.sin(angle)
    reach = min(
        half_width / abs(dx) if abs(dx) > 1e-9 else math.inf,
        half_height / abs(dy) if abs(dy) > 1e-9 else math.inf,
    )
    x = free.x + half_width + reach * dx
    y = free.y + half_height + reach * dy
    return Rect(
        min(max(round(x), free.x), free.right - side),
        min(max(round(y), free.y), free.bottom - side),
        side,
        side,
    )
