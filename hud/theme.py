"""Colours and sizes of the HUD. Colours are sRGB from 0 to 255. Sizes are in theme pixels.

If the panels are over the picture, a frame is 640 x 480 theme pixels. If they are next to it, a frame is
1280 x 720 theme pixels, as wide as the page of `mjsim play`, and the picture in its middle is 832 x 624.

The hues are from the Okabe-Ito palette, which people with colour-vision deficiencies can distinguish. No
information depends on hue alone. For example, messages have symbols and completed rows are crossed out.
"""

from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from hud.state import MessageKind

Rgb = tuple[int, int, int]

PANEL: Final[Rgb] = (13, 17, 24)
PANEL_OPACITY: Final = 0.72  # ensures that text has a contrast of at least 4.5 : 1 in front of a white wall
EDGE: Final[Rgb] = (255, 255, 255)
EDGE_OPACITY: Final = 0.16

TEXT: Final[Rgb] = (248, 250, 252)
QUIET: Final[Rgb] = (216, 222, 230)
DONE: Final[Rgb] = (206, 211, 218)
ACCENT: Final[Rgb] = (240, 228, 66)
PROGRESS: Final[Rgb] = (86, 180, 233)
TILE_COLOUR: Final[Rgb] = (232, 236, 241)

TONES: Final = MappingProxyType(
    {
        MessageKind.INFO: (240, 228, 66),
        MessageKind.SUCCESS: (0, 158, 115),
        MessageKind.REFUSAL: (213, 94, 0),
    }
)


@dataclass(frozen=True)
class Face:
    """A font size in pixels at a frame height of 480, and a font weight (400 regular, 600 semibold)."""

    size: float
    weight: int


TITLE: Final = Face(13, 600)
ITEM: Final = Face(13, 500)
ITEM_CURRENT: Final = Face(13, 650)
DETAIL: Final = Face(12, 400)
LABEL: Final = Face(12, 600)
BAR: Final = Face(14, 500)
CHIP: Final = Face(14, 600)

FRAME: Final = (640, 480)  # width and height of a frame with panels over the picture
BESIDE_FRAME: Final = (1280, 720)  # width and height of a frame with panels next to the picture
MIN_FRAME: Final = (320, 240)  # width and height in pixels of the smallest frame with legible text

MARGIN: Final = 8  # distance between the panels and the edge of the frame
GAP: Final = 6
PADDING: Final = 6
PANEL_RADIUS: Final = 8.0
LINE: Final = 14  # height of a line of text
TILE: Final = 30  # side length of an object's picture, large enough to distinguish objects

# Sizes in the list of bins, which leave space for six bins with three lines of text each.
BIN_TILE: Final = 30
BIN_LINE: Final = 13
BIN_GAP: Final = 4

CHIP_HEIGHT: Final = 28
CHIP_WIDTH: Final = 76

LIST_SHARE: Final = 0.3  # width of the task list as a fraction of the frame width
MAX_LIST_WIDTH: Final = 230
LIST_BOTTOM: Final = 64  # free space below the lists, which keeps objects at the person's feet visible
HEADER: Final = 24
FOOTER: Final = 17
ROW: Final = 36
NUMBER: Final = 19
TARGET: Final = 20  # side length of the receptacle's picture

BINS_WIDTH: Final = 160
BINS_WIDTH_WIDE: Final = 170  # width of the list of bins in frames wider than 4 : 3
BINS_WIDTH_BESIDE: Final = 186  # width of the list of bins next to the picture, which makes the picture 4 : 3

SLOT_WIDTH: Final = 118
SLOT_WIDTH_LONG: Final = 133  # slot width for long object names
SLOT_WIDTH_EMPTY: Final = 86  # slot width for an empty hand, narrow so that objects on the floor stay visible
SLOT_HEIGHT: Final = 40
BETWEEN_HANDS: Final = 64

MESSAGE_LINES: Final = 3
MESSAGE_ICON: Final = 26
POINTER: Final = 36
MAP_INSET: Final = 4
MAX_MAP_HEIGHT: Final = 150  # maximum height of the map, which leaves space for the list of bins above it
