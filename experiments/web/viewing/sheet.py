"""Contact sheets of homes, with a floor plan, two views and a caption for each."""

import errno
from collections.abc import Iterator, Sequence
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from experiments.web.viewing.homes import PLAN, VIEW, Home

COLUMNS, ROWS = 2, 5
GAP, CAPTION = 24, 44  # pixels
WIDTH, HEIGHT = PLAN[0] + VIEW[0], PLAN[1] + CAPTION  # size of a home's card
INK, QUIET, PAPER = (22, 33, 43), (74, 85, 96), 255
Image = NDArray[np.uint8]


def sheets(homes: Sequence[tuple[Home, Path]]) -> Iterator[Image]:
    """Yield RGB sheets of ten homes each, given with the folders of their pictures."""
    for first in range(0, len(homes), COLUMNS * ROWS):
        cards = [_card(home, folder) for home, folder in homes[first : first + COLUMNS * ROWS]]
        rows = -(-len(cards) // COLUMNS)
        across = min(COLUMNS, len(cards))
        sheet = np.full((GAP + rows * (HEIGHT + GAP), GAP + across * (WIDTH + GAP), 3), PAPER, np.uint8)
        for number, card in enumerate(cards):
            row, column = divmod(number, COLUMNS)
            top, left = GAP + row * (HEIGHT + GAP), GAP + column * (WIDTH + GAP)
            sheet[top : top + HEIGHT, left : left + WIDTH] = card
        yield sheet


def _card(home: Home, folder: Path) -> Image:
    card = np.full((HEIGHT, WIDTH, 3), PAPER, np.uint8)
    plan, *views = (_picture(folder / name) for name in home.pictures)
    height, width = plan.shape[:2]
    card[CAPTION : CAPTION + height, :width] = plan
    for number, view in enumerate(views):
        top = CAPTION + number * VIEW[1]
        card[top : top + VIEW[1], PLAN[0] :] = cv2.resize(view, VIEW, interpolation=cv2.INTER_AREA)
    face, base = cv2.FontFace("sans"), CAPTION - 16
    (end, _), _ = cv2.putText(card, f"{home.label}  ", (0, base), INK, face, 22, 650)
    cv2.putText(card, f"{home.size}, {home.origin}", (end, base), QUIET, face, 20, 400)
    return card


def _picture(path: Path) -> Image:
    picture = cv2.imread(str(path))
    if picture is None:
        raise OSError(errno.EIO, "is no picture; remove its folder, and it is drawn again", str(path))
    return np.asarray(picture[..., ::-1], np.uint8)
