"""Draw pictures and rug patterns in the colours of a home."""

import math
from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

from mjsim.generator.furniture.appearance import Appearance
from mjsim.generator.furniture.piece import DrawnTexture

Image = NDArray[np.float64]  # RGB image from 0 to 1, shape (height, width, 3)
Plane = NDArray[np.float64]  # array of pixel values, shape (height, width)
Style = Callable[[np.random.Generator, Image, Plane, Plane, Image], None]


def painting(rng: np.random.Generator, look: Appearance, wide: int = 128, high: int = 96) -> DrawnTexture:
    """Create a random picture with a width of `wide` pixels and a height of `high` pixels."""
    return _texture("picture", rng, lambda own: _painted(own, look, wide, high))


def carpet(rng: np.random.Generator, look: Appearance, round_one: bool = False) -> DrawnTexture:
    """Create a random pattern for a rug. Round rugs have a pattern of rings."""
    return _texture("rug", rng, lambda own: _woven_rug(own, look, round_one))


def _texture(
    name: str, rng: np.random.Generator, draw: Callable[[np.random.Generator], Image]
) -> DrawnTexture:
    """Create a texture that is drawn when it is needed, because most pieces do not fit and are discarded."""
    seed = int(rng.integers(2**40))

    def png() -> bytes:
        pixels = np.clip(255 * draw(np.random.default_rng(seed))[..., ::-1], 0, 255).astype(np.uint8)
        return cv2.imencode(".png", pixels, [cv2.IMWRITE_PNG_COMPRESSION, 2])[1].tobytes()

    return DrawnTexture(f"{name}_{seed:010x}", png)


def _painted(rng: np.random.Generator, look: Appearance, wide: int, high: int) -> Image:
    y, x = np.mgrid[0:high, 0:wide] / np.array([high, wide]).reshape(2, 1, 1)
    colours = _palette(rng, look, 6)
    image: Image = (0.75 + 0.25 * colours[0]) * (1 - 0.25 * y[..., None])
    _STYLES[int(rng.integers(len(_STYLES)))](rng, image, x, y, colours)
    return image


def _woven_rug(rng: np.random.Generator, look: Appearance, round_one: bool) -> Image:
    n = 128
    y, x = (np.mgrid[0:n, 0:n] + 0.5) / n
    ground, one, two, three = _palette(rng, look, 4)
    ground = 0.55 * ground + 0.45 * np.array([0.9, 0.87, 0.8]) if rng.random() < 0.6 else ground
    image = np.broadcast_to(ground, (n, n, 3)).copy()
    edge = np.minimum(np.minimum(x, 1 - x), np.minimum(y, 1 - y))
    style, k = "rings" if round_one else _RUGS[int(rng.integers(len(_RUGS)))], int(rng.integers(3, 7))
    if style == "rings":
        edge = 0.5 - np.hypot(x - 0.5, y - 0.5)
        image[np.mod(2 * k * edge, 1) < 0.35], image[edge < 0.04] = one, two
    elif style == "stripes":
        bands = np.mod(2 * k * x, 1)
        image[bands < 0.3], image[(bands > 0.5) & (bands < 0.6)] = one, two
    elif style == "lozenges":
        away = np.abs(np.mod(x * k, 1) - 0.5) + np.abs(np.mod(y * k, 1) - 0.5)
        image[away < 0.4], image[away < 0.25], image[away < 0.1] = one, two, three
    elif style == "medallion":
        lobes = 1 + 0.07 * np.cos(12 * np.arctan2(y - 0.5, x - 0.5))
        away = np.hypot((x - 0.5) * 1.3, y - 0.5) * lobes
        image[away < 0.34], image[away < 0.26], image[away < 0.12] = one, ground, two
    elif style == "zigzag":
        image[np.mod(y * (k // 2 + 1) + 0.25 * np.abs(np.mod(x * 4, 2) - 1), 0.5) < 0.05] = 0.35 * one
    elif style == "checks":
        image[(np.floor(x * k) + np.floor(y * k)) % 2 == 0] = 0.8 * one + 0.2 * ground
    if style in ("lozenges", "medallion", "border"):
        image[edge < 0.09], image[edge < 0.07], image[edge < 0.025] = two, one, three
    worn = cv2.GaussianBlur(rng.standard_normal((n, n)), (0, 0), 1.2)
    return np.asarray(image * (1 + 0.1 * worn[..., None]))


_RUGS = ("stripes", "lozenges", "medallion", "zigzag", "checks", "border")


def _hills(rng: np.random.Generator, image: Image, x: Plane, y: Plane, colours: Image) -> None:
    aspect = x.shape[1] / x.shape[0]
    from_sun = np.hypot((x - rng.uniform(0.2, 0.8)) * aspect, y - rng.uniform(0.15, 0.35))
    image[from_sun < rng.uniform(0.07, 0.13)] = (1.0, 0.9, 0.7)
    waves, tall = ((1.5, 5), 0.09) if rng.random() < 0.5 else ((8, 16), 0.02)
    for i in range(4):
        crest = 0.42 + 0.14 * i + tall * np.sin(rng.uniform(*waves) * x + rng.uniform(0, 6.3))
        image[y > crest] = colours[1] * (1 - 0.18 * i) + 0.06 * (3 - i)


def _discs(rng: np.random.Generator, image: Image, x: Plane, y: Plane, colours: Image) -> None:
    aspect = x.shape[1] / x.shape[0]
    for colour in colours:
        away = np.hypot((x - rng.uniform(0.1, 0.9)) * aspect, y - rng.uniform(0.1, 0.9))
        disc = away < rng.uniform(0.1, 0.32)
        image[disc] = 0.25 * image[disc] + 0.75 * colour


def _fields(rng: np.random.Generator, image: Image, x: Plane, y: Plane, colours: Image) -> None:
    rows = np.digitize(y + 0.01 * np.sin(20 * x), np.sort(rng.uniform(0.1, 0.9, 3)))
    for i in range(4):
        image[rows == i] = colours[i]
    image += 0.05 * cv2.GaussianBlur(rng.standard_normal(x.shape), (0, 0), 2.0)[..., None]


def _branch(rng: np.random.Generator, image: Image, x: Plane, y: Plane, colours: Image) -> None:
    aspect, stem, lean = x.shape[1] / x.shape[0], rng.uniform(0.4, 0.6), rng.uniform(-0.15, 0.15)
    image[np.abs(x - stem - lean * (1 - y)) < 0.008] = 0.5 * colours[1]
    for i in range(9):
        at, side = 0.12 + 0.085 * i, 1 if i % 2 else -1
        p, q = (x - stem - lean * (1 - at) - side * 0.13) * aspect, y - at + 0.05
        along = p * math.cos(0.7) - q * math.sin(0.7) * side
        across = p * math.sin(0.7) * side + q * math.cos(0.7)
        image[(along / 0.15) ** 2 + (across / 0.045) ** 2 < 1] = colours[1 + i % 2] * 0.8


def _town(rng: np.random.Generator, image: Image, x: Plane, y: Plane, colours: Image) -> None:
    left = 0.0
    while left < 1:
        wide, tall = rng.uniform(0.08, 0.18), rng.uniform(0.25, 0.7)
        tower = (x >= left) & (x < left + wide) & (y > 1 - tall)
        image[tower] = colours[int(rng.integers(len(colours)))] * rng.uniform(0.6, 1.0)
        lit = (np.mod((x - left) / wide * 3, 1) > 0.5) & (np.mod(y * 14, 1) > 0.5) & (y > 1.06 - tall)
        image[tower & lit] = (0.98, 0.9, 0.6)
        left += wide


def _woven(rng: np.random.Generator, image: Image, x: Plane, y: Plane, colours: Image) -> None:
    for i in range(int(rng.integers(5, 9))):
        away = np.abs((x if i % 2 else y) - rng.uniform(0, 1))
        image[away < rng.uniform(0.02, 0.09)] = colours[i % len(colours)]


_STYLES: tuple[Style, ...] = (_hills, _hills, _discs, _fields, _branch, _town, _woven)


def _palette(rng: np.random.Generator, look: Appearance, count: int) -> Image:
    """Draw random shades of the home's colours, shape (count, 3)."""
    chosen = np.array(look.colours)[rng.permutation(len(look.colours))[: min(count, 5)]]
    while len(chosen) < count:
        chosen = np.vstack([chosen, chosen[int(rng.integers(len(chosen)))] * rng.uniform(0.5, 0.9)])
    return np.asarray(np.clip(chosen * rng.uniform(0.85, 1.15, (len(chosen), 1)), 0, 1))
