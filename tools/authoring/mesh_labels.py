"""Paint small RGB textures for the meshes of objects and receptacles, such as covers and labels."""

import functools
from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

Picture = NDArray[np.uint8]
Colour = tuple[int, int, int]
SIDE = 128
WHITE, INK = (250, 250, 245), (25, 25, 30)


def object_textures() -> dict[str, Picture]:
    covers = (_hardback, _paperback, _magazine, _pages, _comic, _towel, _denim, _calculator, _notebook)
    return _painted(*covers, _can, _carton, _newspaper, _jar)


def receptacle_textures() -> dict[str, Picture]:
    """Return RGB textures by name, with shape (128, 128, 3), or (64, 128, 3) for wide signs."""
    return _painted(_wicker, _toys_sign, _office_sign)


def _painted(*painters: Callable[[], Picture]) -> dict[str, Picture]:
    return {painter.__name__.removeprefix("_"): painter() for painter in painters}


def _on(
    colour: Colour, rows: slice | None = None
) -> Callable[[Callable[[Picture], None]], Callable[[], Picture]]:
    """Make a painter start on a plain colour. With `rows`, crop the picture to them at half the height."""

    def decorate(paint: Callable[[Picture], None]) -> Callable[[], Picture]:
        @functools.wraps(paint)
        def picture() -> Picture:
            p = np.full((SIDE, SIDE, 3), colour, dtype=np.uint8)
            paint(p)
            if rows is None:
                return p
            return np.asarray(cv2.resize(p[rows], (SIDE, SIDE // 2), interpolation=cv2.INTER_AREA), np.uint8)

        return picture

    return decorate


def _write(
    picture: Picture, text: str, x: int, y: int, scale: float, colour: Colour, weight: int = 2
) -> None:
    """Draw text with its centre at column `x` and its baseline at row `y`."""
    (width, _), _ = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, scale, weight)
    at = (x - width // 2, y)
    cv2.putText(picture, text, at, cv2.FONT_HERSHEY_SIMPLEX, scale, colour, weight, cv2.LINE_AA)


def _box(picture: Picture, x0: int, y0: int, x1: int, y1: int, colour: Colour, weight: int = -1) -> None:
    cv2.rectangle(picture, (x0, y0), (x1, y1), colour, weight)


def _disc(picture: Picture, x: int, y: int, radius: int, colour: Colour) -> None:
    cv2.circle(picture, (x, y), radius, colour, -1, cv2.LINE_AA)


@_on((150, 18, 28))
def _hardback(p: Picture) -> None:
    _box(p, 8, 8, 119, 119, (235, 195, 90), 3)
    _write(p, "TALES", 64, 46, 0.9, (245, 215, 120), 3)
    _disc(p, 64, 82, 22, (235, 195, 90))
    _disc(p, 73, 76, 18, (150, 18, 28))


@_on((20, 125, 80))
def _paperback(p: Picture) -> None:
    _box(p, 0, 70, 127, 127, (245, 235, 200))
    cv2.fillPoly(p, [np.array([[10, 112], [48, 50], [86, 112]])], (12, 70, 50), cv2.LINE_AA)
    cv2.fillPoly(p, [np.array([[55, 112], [90, 64], [122, 112]])], (30, 95, 70), cv2.LINE_AA)
    _disc(p, 100, 38, 13, (255, 210, 70))
    _write(p, "PEAKS", 56, 28, 0.8, WHITE, 2)


@_on((240, 60, 150))
def _magazine(p: Picture) -> None:
    _box(p, 0, 0, 127, 34, (255, 225, 40))
    _write(p, "STYLE", 64, 28, 1.0, (220, 20, 110), 3)
    cv2.ellipse(p, (64, 134), (44, 42), 0, 0, 360, (40, 90, 200), -1, cv2.LINE_AA)
    cv2.ellipse(p, (64, 74), (26, 32), 0, 0, 360, (90, 45, 25), -1, cv2.LINE_AA)
    cv2.ellipse(p, (64, 80), (17, 22), 0, 0, 360, (250, 205, 170), -1, cv2.LINE_AA)
    for y in (50, 62, 74):
        _box(p, 6, y, 30, y + 5, WHITE)


@_on((250, 246, 230))
def _pages(p: Picture) -> None:
    for half in (8, 70):
        for y in range(14, 118, 10):
            cv2.line(p, (y, half), (y, half + 48 - 12 * ((y // 10) % 4 == 3)), (120, 115, 110), 3)
    _box(p, 60, 74, 100, 118, (90, 150, 210))
    cv2.line(p, (0, 64), (127, 64), (150, 140, 120), 3)


@_on((30, 110, 220))
def _comic(p: Picture) -> None:
    _box(p, 0, 0, 127, 34, (255, 215, 0))
    _write(p, "ZOOM!", 64, 28, 0.95, (215, 20, 20), 3)
    angles = np.linspace(0, 2 * np.pi, 25)[:-1]
    reach = np.where(np.arange(24) % 2, 30, 44)
    burst = np.column_stack([64 + reach * np.cos(angles), 82 + 0.9 * reach * np.sin(angles)])
    cv2.fillPoly(p, [burst.astype(np.int32)], (255, 225, 60), cv2.LINE_AA)
    _disc(p, 64, 82, 20, (220, 30, 30))
    _write(p, "Z", 64, 94, 1.1, WHITE, 4)


@_on((250, 190, 40))
def _towel(p: Picture) -> None:
    for y in (12, 44, 76, 108):
        _box(p, 0, y, 127, y + 11, (252, 248, 235))


def _denim() -> Picture:
    weave = np.add.outer(np.arange(SIDE), np.arange(SIDE)) % 4 < 2
    p = np.where(weave[..., None], (62, 104, 180), (50, 88, 160)).astype(np.uint8)
    gold = (235, 165, 60)
    _box(p, 0, 0, 127, 13, (30, 54, 105))
    cv2.line(p, (0, 14), (127, 14), gold, 2)
    for x in (36, 64, 92):
        _box(p, x - 3, 0, x + 3, 16, (60, 98, 165))
    cv2.line(p, (64, 14), (64, 62), gold, 2)
    _disc(p, 64, 7, 5, (230, 210, 150))
    for x in (18, 110):
        cv2.ellipse(p, (x, 14), (26, 30), 0, 0, 360, gold, 2, cv2.LINE_AA)
    for start, stop in (((0, 116), (44, 126)), ((128, 116), (84, 126))):
        cv2.line(p, start, stop, (150, 180, 225), 12, cv2.LINE_AA)
    return p


@_on((45, 48, 58))
def _calculator(p: Picture) -> None:
    _box(p, 10, 8, 117, 36, (175, 205, 160))
    _write(p, "1024", 88, 31, 0.75, INK, 2)
    for row in range(4):
        for column in range(4):
            colour = (245, 140, 30) if column == 3 else (235, 235, 240)
            if (row, column) == (0, 0):
                colour = (220, 50, 50)
            x, y = 9 + 29 * column, 46 + 20 * row
            _box(p, x, y, x + 22, y + 14, colour)


@_on((120, 50, 175))
def _notebook(p: Picture) -> None:
    _box(p, 34, 28, 112, 66, WHITE)
    _write(p, "NOTES", 73, 54, 0.65, (80, 30, 120), 2)
    cv2.line(p, (34, 100), (112, 100), (250, 205, 60), 6)


@_on((215, 20, 35))
def _can(p: Picture) -> None:
    for x in (0, 64):
        wave = np.array([[x + k, 80 + 10 * np.sin(k / 64 * 2 * np.pi)] for k in range(65)])
        cv2.polylines(p, [wave.astype(np.int32)], False, WHITE, 9, cv2.LINE_AA)
        _write(p, "COLA", x + 32, 60, 0.72, WHITE, 2)
    _box(p, 0, 0, 127, 6, (200, 202, 208))
    _box(p, 0, 121, 127, 127, (200, 202, 208))


@_on((248, 250, 252))
def _carton(p: Picture) -> None:
    _box(p, 0, 0, 127, 26, (40, 120, 220))
    _box(p, 0, 104, 127, 127, (60, 170, 70))
    _write(p, "MILK", 64, 62, 1.2, (25, 90, 200), 4)
    for x, y, r in ((28, 88, 11), (60, 84, 8), (98, 90, 13)):
        _disc(p, x, y, r, INK)


@_on((232, 230, 222))
def _newspaper(p: Picture) -> None:
    _write(p, "DAILY NEWS", 64, 22, 0.62, INK, 2)
    cv2.line(p, (4, 30), (123, 30), INK, 2)
    _box(p, 8, 38, 70, 80, (95, 95, 100))
    _disc(p, 30, 58, 10, (180, 180, 180))
    for x0, x1, top in ((78, 120, 40), (8, 40, 88), (46, 74, 88)):
        for y in range(top, 122, 7):
            cv2.line(p, (x0, y), (x1, y), (110, 110, 110), 3)


@_on((255, 245, 220))
def _jar(p: Picture) -> None:
    for x in (32, 96):
        _disc(p, x, 70, 24, (220, 40, 60))
        _box(p, x - 3, 36, x + 3, 50, (40, 140, 50))
        _write(p, "JAM", x, 30, 0.7, (150, 20, 40), 2)
    _box(p, 0, 104, 127, 116, (220, 40, 60))


def _wicker() -> Picture:
    """Paint a seamless basket weave, with strands that are darker at their ends."""
    t = np.arange(SIDE)
    cell = 32
    across = (np.add.outer(t // cell, t // cell) % 2).astype(bool)
    bulge = np.sin(np.pi * ((t % cell) + 0.5) / cell)
    strand = np.where((t % 8) < 1, 0.72, 1.0)
    horizontal = 0.62 + 0.38 * np.outer(strand, bulge)
    vertical = 0.62 + 0.38 * np.outer(bulge, strand)
    shade = np.where(across, horizontal, vertical)
    picture: Picture = np.clip(shade[..., None] * np.array([250, 208, 142]), 0, 255).astype(np.uint8)
    return picture


@_on((255, 250, 235), rows=slice(20, 108))
def _toys_sign(p: Picture) -> None:
    for letter, x, colour in (
        ("T", 22, (225, 40, 40)),
        ("O", 52, (30, 110, 220)),
        ("Y", 80, (40, 160, 60)),
        ("S", 107, (240, 140, 20)),
    ):
        _write(p, letter, x, 92, 1.9, colour, 7)


@_on((250, 248, 240), rows=slice(24, 112))
def _office_sign(p: Picture) -> None:
    _write(p, "OFFICE", 64, 62, 1.05, (30, 50, 70), 3)
    _write(p, "SUPPLIES", 64, 98, 0.78, (30, 50, 70), 2)
