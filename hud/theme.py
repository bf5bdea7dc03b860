"""Colours and sizes of the HUD. Colours are sRGB 0..255; sizes are px of a 640 x 480 frame.

Hues are from the Okabe-Ito palette, which people with colour-vision deficiencies can tell apart; nothing is
told by hue alone: tones of messages have a symbol, done rows are crossed out, the current row is bold.
"""

from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from hud.state import MessageKind

Rgb = tuple[int, int, int]

PANEL: Final[Rgb] = (13, 17, 24)
PANEL_OPACITY: Final = 0.72  # white text stays at 4.5 : 1 or better over a white wall
EDGE: Final[Rgb] = (255, 255, 255)
EDGE_OPACITY: Final = 0.16

TEXT: Final[Rgb] = (248, 250, 252)
QUIET: Final[Rgb] = (216, 222, 230)
DONE: Final[Rgb] = (206, 211, 218)
ACCENT: Final[Rgb] = (240, 228, 66)
PROGRESS: Final[Rgb] = (86, 180, 233)
TILE: Final[Rgb] = (232, 236, 241)

TONES: Final = MappingProxyType(
    {
        MessageKind.INFO: (240, 228, 66),
        MessageKind.SUCCESS: (0, 158, 115),
        MessageKind.REFUSAL: (213, 94, 0),
    }
)


@dataclass(frozen=True)
class Face:
    """Size (px at 480 px height) and weight (400 regular, 600 semibold) of a text."""

    size: float
    weight: int


TITLE: Final = Face(13, 600)
ITEM: Final = Face(13, 500)
ITEM_CURRENT: Final = Face(13, 650)
DETAIL: Final = Face(12, 400)
LABEL: Final = Face(12, 600)
BAR: Final = Face(14, 500)
CHIP: Final = Face(14, 600)
