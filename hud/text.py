"""Measure, shorten, wrap and rasterize text with OpenCV's built-in font."""

import functools
import re

import cv2
import numpy as np
from numpy.typing import NDArray

from hud.theme import Face

ELLIPSIS = "…"
BUILT_IN_FONT = "sans"
_SMALL = 10  # font size in pixels below which spaces and decimal points are too narrow
_POINT = re.compile(r"(?<=\d)\.(?=\d)")
_WORD = re.compile(r"\S+(?:\sm(?!\S))?")  # keeps a number and its unit "m" on one line


class Typeface:
    """OpenCV's built-in variable sans font, with `unit` frame pixels per theme pixel."""

    def __init__(self, unit: float) -> None:
        self._unit = unit
        self._font = cv2.FontFace(BUILT_IN_FONT)
        self.width = functools.lru_cache(4096)(self._width)

    def px(self, size: float) -> int:
        """Convert theme pixels to frame pixels."""
        return round(size * self._unit)

    def _width(self, text: str, face: Face) -> int:
        if not text:
            return 0
        size = max(1, self.px(face.size))
        left, _, width, _ = cv2.getTextSize(
            (0, 0), _spaced(text, size), (0, 0), self._font, size, face.weight
        )
        return int(max(width, left + width))

    def fit(self, text: str, face: Face, width: int) -> str:
        """Fit text into one line of at most `width` pixels. Long text is shortened with an ellipsis."""
        line = " ".join(text.split())
        if self.width(line, face) <= width:
            return line
        low, high = 0, len(line)  # bisect for the longest prefix that fits
        while low < high:
            middle = (low + high + 1) // 2
            if self.width(line[:middle].rstrip(" ,.") + ELLIPSIS, face) <= width:
                low = middle
            else:
                high = middle - 1
        return line[:low].rstrip(" ,.") + ELLIPSIS if low else ""

    def wrap(self, text: str, face: Face, width: int, lines: int) -> tuple[str, ...]:
        """Break text into at most `lines` lines of `width` pixels. The last line may be shortened."""
        done: list[str] = []
        words: list[str] = _WORD.findall(text)
        while words and len(done) < lines - 1:
            count = 1
            while count < len(words) and self.width(" ".join(words[: count + 1]), face) <= width:
                count += 1
            done.append(self.fit(" ".join(words[:count]), face, width))
            words = words[count:]
        if words:
            done.append(self.fit(" ".join(words), face, width))
        return tuple(done)

    def paragraph(self, text: str, face: Face, width: int, lines: int) -> tuple[str, ...]:
        """Fit text into one line of `width` pixels. Break longer text at line breaks and between words."""
        whole = " ".join(text.split())
        if lines <= 1 or self.width(whole, face) <= width:
            fitted = self.fit(whole, face, width)
            return (fitted,) if fitted else ()
        parts = [part.strip(" ·,") for part in text.split("\n")]
        broken: list[str] = []
        for i, part in enumerate(parts):
            still_to_come = len(parts) - 1 - i
            broken += self.wrap(part, face, width, min(2, lines - len(broken) - still_to_come))
        return tuple(broken)

    def rasterise(self, text: str, face: Face) -> tuple[NDArray[np.uint8], int]:
        """Return the mask of a line of text, from 0 to 255, and the row of its baseline.

        The first column of the mask is empty.
        """
        size = max(1, self.px(face.size))
        baseline = size + size // 4
        mask = np.zeros((baseline + size // 2, self.width(text, face) + size), dtype=np.uint8)
        cv2.putText(mask, _spaced(text, size), (1, baseline), 255, self._font, size, face.weight)
        return mask, baseline


def _spaced(text: str, size: int) -> str:
    return _POINT.sub(" . ", text.replace(" ", "  ")) if size < _SMALL else text
