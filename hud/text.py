"""Text: measuring, shortening, wrapping and rasterising with the font that OpenCV carries inside."""

import functools

import cv2
import numpy as np
from numpy.typing import NDArray

ELLIPSIS = "…"
BUILT_IN_FONT = "sans"


class Typeface:
    """OpenCV's built-in variable sans font. Sizes in px, weights 100..1000."""

    def __init__(self) -> None:
        self._face = cv2.FontFace(BUILT_IN_FONT)
        self._width = functools.lru_cache(4096)(self._measure)

    def width(self, text: str, size: int, weight: int) -> int:
        """Width of a line, px."""
        return self._width(text, size, weight)

    def _measure(self, text: str, size: int, weight: int) -> int:
        if not text:
            return 0
        left, _, width, _ = cv2.getTextSize((0, 0), text, (0, 0), self._face, size, weight)
        return int(max(width, left + width))

    def fit(self, text: str, size: int, weight: int, width: int) -> str:
        """`text` in one line of at most `width` px, ending in an ellipsis when it had to be cut."""
        line = " ".join(text.split())
        if self.width(line, size, weight) <= width:
            return line
        low, high = 0, len(line)  # the longest prefix that fits, by bisection
        while low < high:
            middle = (low + high + 1) // 2
            if self.width(line[:middle].rstrip(" ,.") + ELLIPSIS, size, weight) <= width:
                low = middle
            else:
                high = middle - 1
        return line[:low].rstrip(" ,.") + ELLIPSIS if low else ""

    def wrap(self, text: str, size: int, weight: int, width: int, lines: int) -> tuple[str, ...]:
        """`text` broken between words into at most `lines` lines; the last is cut with an ellipsis."""
        done: list[str] = []
        words = text.split()
        while words and len(done) < lines - 1:
            count = 1
            while count < len(words) and self.width(" ".join(words[: count + 1]), size, weight) <= width:
                count += 1
            done.append(self.fit(" ".join(words[:count]), size, weight, width))
            words = words[count:]
        if words:
            done.append(self.fit(" ".join(words), size, weight, width))
        return tuple(done)

    def paragraph(self, text: str, size: int, weight: int, width: int, lines: int) -> tuple[str, ...]:
        """`text` in one line when it fits, else broken first at its line breaks and then between words."""
        whole = " ".join(text.split())
        if lines <= 1 or self.width(whole, size, weight) <= width:
            fitted = self.fit(whole, size, weight, width)
            return (fitted,) if fitted else ()
        parts = [part.strip(" ·,") for part in text.split("\n")]
        broken: list[str] = []
        for i, part in enumerate(parts):
            still_to_come = len(parts) - 1 - i
            broken += self.wrap(part, size, weight, width, min(2, lines - len(broken) - still_to_come))
        return tuple(broken)

    def stamp(self, text: str, size: int, weight: int) -> tuple[NDArray[np.uint8], int]:
        """Coverage of a line of text, and its baseline's row in it.

        Returns:
            Mask (h, w), 0 outside and 255 inside the glyphs, with a column of air on the left, and the row.
        """
        baseline = size + size // 4
        mask = np.zeros((baseline + size // 2, self.width(text, size, weight) + size), dtype=np.uint8)
        cv2.putText(mask, text, (1, baseline), 255, self._face, size, weight)
        return mask, baseline
