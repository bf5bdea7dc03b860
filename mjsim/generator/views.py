"""Draw the landscapes that are seen through the windows of a home."""

from collections.abc import Callable

import cv2
import numpy as np

from mjsim.generator.furniture.artwork import Image, Plane
from mjsim.generator.values import Asset, Rgb
from mjsim.house.catalogue.generated_names import stream

WIDE, HIGH = 384, 160  # size of a landscape in pixels
_SKIES: tuple[tuple[Rgb, Rgb], ...] = (  # colours at the top and at the horizon
    ((0.55, 0.73, 0.9), (0.86, 0.92, 0.95)),
    ((0.66, 0.76, 0.84), (0.93, 0.92, 0.88)),
    ((0.47, 0.66, 0.88), (0.95, 0.88, 0.8)),
)
_GREENS: tuple[Rgb, ...] = ((0.36, 0.5, 0.27), (0.45, 0.56, 0.3), (0.3, 0.45, 0.33), (0.55, 0.55, 0.32))
_FACADES: tuple[Rgb, ...] = ((0.85, 0.78, 0.68), (0.72, 0.5, 0.42), (0.8, 0.8, 0.78), (0.64, 0.66, 0.7))

Style = Callable[[np.random.Generator, Image, Plane, Plane], None]


def landscapes(seed: int) -> list[Asset]:
    """Draw a landscape for each side of a home, as the materials `view_north` and so on."""
    rng, found = stream(seed, "views"), list[Asset]()
    sky = _SKIES[int(rng.integers(len(_SKIES)))]
    styles = rng.permutation(len(_STYLES))
    for side, style in zip(("north", "east", "south", "west"), styles, strict=True):
        own = stream(seed, "view", side)
        rows, columns = np.ogrid[:HIGH, :WIDE]
        y, x = rows / HIGH, columns / WIDE
        blend = np.clip(y / 0.55, 0, 1)[..., None]
        image = ((1 - blend) * np.array(sky[0]) + blend * np.array(sky[1])).repeat(WIDE, axis=1)
        clouds = cv2.GaussianBlur(own.standard_normal((HIGH, WIDE)), (0, 0), 18, sigmaY=5)
        image += 0.6 * np.clip(clouds / clouds.std() - 0.9, 0, 1)[..., None] * (1 - image)
        _STYLES[style](own, image, x, y)
        pixels = np.clip(255 * image[..., ::-1], 0, 255).astype(np.uint8)
        png = cv2.imencode(".png", pixels, [cv2.IMWRITE_PNG_COMPRESSION, 6])[1].tobytes()
        name = f"view_{side}"
        texture = f'<texture name="{name}_image" type="2d" file="{name}_image.png"/>'
        material = f'<material name="{name}" texture="{name}_image" emission="0.75"/>'
        found += [Asset(f"{name}_image", texture, png), Asset(name, material)]
    return found


def _ridge(rng: np.random.Generator, x: Plane, height: float, rough: float) -> Plane:
    """Return the height of a random ridge in each column, as a share of the image from the top."""
    edge = np.full_like(x, height)
    for k in (1, 2, 4, 9):
        edge += rough / k * np.sin(6.3 * k * rng.uniform(1, 2) * x + rng.uniform(0, 6.3))
    return edge


def _ground(rng: np.random.Generator, image: Image, y: Plane, edge: Plane, colour: Rgb, grain: float) -> None:
    """Fill the image below an edge with a colour and random grain."""
    noise = cv2.GaussianBlur(rng.standard_normal((HIGH, WIDE)), (0, 0), 1.5)
    shade = (1 + grain * noise) * (1.1 - 0.3 * np.clip(y - edge, 0, 1))
    image[y > edge] = (np.array(colour) * shade[..., None])[y > edge]


def _trees(rng: np.random.Generator, image: Image, x: Plane, y: Plane, low: float, count: int) -> None:
    leaves = 1 + 0.1 * np.sin(40 * x + 55 * y)
    for _ in range(count):
        u, v, r = rng.uniform(0, 1), low + rng.uniform(-0.02, 0.06), rng.uniform(0.03, 0.09)
        crown = np.hypot((x - u) * WIDE / HIGH, (y - v + 1.2 * r) / 1.3) < r * leaves
        trunk = (np.abs(x - u) < 0.08 * r) & (np.abs(y - v) < 0.8 * r)
        image[trunk] = (0.36, 0.28, 0.2)
        green = np.array(_GREENS[int(rng.integers(len(_GREENS)))])
        shade = 1.25 - 0.5 * np.clip((y - v + 2.4 * r) / (2.6 * r), 0, 1)
        image[crown] = green * np.broadcast_to(shade, crown.shape)[crown, None]


def _hills(rng: np.random.Generator, image: Image, x: Plane, y: Plane) -> None:
    for i in range(3):
        far = np.array((0.62, 0.72, 0.76)) * (1 - i / 3) + np.array(_GREENS[i]) * (i / 3)
        _ground(rng, image, y, _ridge(rng, x, 0.42 + 0.09 * i, 0.05), (far[0], far[1], far[2]), 0.03)
    _ground(rng, image, y, _ridge(rng, x, 0.68, 0.01), _GREENS[int(rng.integers(4))], 0.12)
    _trees(rng, image, x, y, 0.72, int(rng.integers(5, 12)))


def _town(rng: np.random.Generator, image: Image, x: Plane, y: Plane) -> None:
    for depth in range(2):
        left = -0.05
        while left < 1:
            wide, top = rng.uniform(0.08, 0.17), rng.uniform(0.22, 0.5) + 0.08 * depth
            facade = np.array(_FACADES[int(rng.integers(len(_FACADES)))]) * (0.85 + 0.15 * depth)
            house = (x >= left) & (x < left + wide) & (y > top)
            image[house] = facade if depth else 0.5 * facade + 0.4
            u, v = np.mod((x - left) / 0.028, 1), np.mod((y - top) / 0.085, 1)
            image[house & (np.abs(u - 0.5) < 0.22) & (np.abs(v - 0.5) < 0.25)] *= 0.62
            image[house & (y < top + 0.02)] = facade * 0.6
            left += wide + rng.uniform(0, 0.02)
    _ground(rng, image, y, np.full_like(x, 0.8), (0.55, 0.55, 0.55), 0.03)
    _trees(rng, image, x, y, 0.84, int(rng.integers(3, 9)))


def _lake(rng: np.random.Generator, image: Image, x: Plane, y: Plane) -> None:
    _ground(rng, image, y, _ridge(rng, x, 0.46, 0.04), (0.5, 0.62, 0.66), 0.03)
    _ground(rng, image, y, np.full_like(x, 0.55), (0.5, 0.66, 0.76), 0.06)
    image[(y > 0.55) & (np.sin(260 * y + 9 * np.sin(14 * x)) > 0.93)] *= 1.1
    _ground(rng, image, y, _ridge(rng, x, 0.74, 0.02), _GREENS[int(rng.integers(4))], 0.12)
    _trees(rng, image, x, y, 0.78, int(rng.integers(2, 7)))


def _park(rng: np.random.Generator, image: Image, x: Plane, y: Plane) -> None:
    _ground(rng, image, y, _ridge(rng, x, 0.5, 0.02), (0.42, 0.54, 0.4), 0.15)
    _ground(rng, image, y, np.full_like(x, 0.6), _GREENS[int(rng.integers(4))], 0.1)
    path = np.abs(x - 0.5 - 0.3 * np.sin(5 * y + rng.uniform(0, 6))) < 0.25 * (y - 0.6)
    image[path & (y > 0.6)] = (0.76, 0.7, 0.58)
    _trees(rng, image, x, y, 0.62, int(rng.integers(8, 16)))
    _trees(rng, image, x, y, 0.8, int(rng.integers(1, 5)))


_STYLES: tuple[Style, ...] = (_hills, _town, _lake, _park)
