"""Paint the procedural textures of the apartment: repeating surfaces and decals.

The random generator of each texture is seeded by its name, so that a new texture does not change the others.
Grey textures get their colour from a material. "Tinted" textures are divided by the colour of their material,
so that the material also looks right if textures are off. Textiles are in `tools.authoring.textiles`, and
pictures such as views, art and screens are in `tools.authoring.artwork`.
"""

import zlib
from collections.abc import Callable, Mapping
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from mjsim.support.files import replacing
from mjsim.values.errors import AssetError
from tools.authoring import artwork, textiles
from tools.authoring.patterns import (
    Floats,
    blend,
    disc,
    flat,
    grid,
    joints,
    noise,
    ramp,
    rgb,
    smooth_step,
    tile_tones,
    to_bytes,
)

Painter = Callable[[np.random.Generator], Floats]


def _planks(rng: np.random.Generator, light: str, dark: str) -> Floats:
    """Paint 16 rows of two floor boards each, along x. 512 pixels correspond to 2 m."""
    size, rows = 512, 16
    height = size // rows
    grain = 0.5 * noise(rng, (size, size), roll_off=1.1, stretch=14.0)
    tone = np.zeros((size, size))
    seams = np.zeros((size, size))
    for row in range(rows):
        band = slice(row * height, (row + 1) * height)
        grain[band] = np.roll(grain[band], int(rng.integers(size)), axis=1)
        start = int(rng.integers(size))
        columns = (np.arange(size) - start) % size
        board = (columns >= rng.integers(size * 2 // 5, size * 3 // 5)).astype(int)
        tone[band] = rng.uniform(-1.0, 1.0, 2)[board]
        seams[band, start] = 1.0
        seams[band, np.flatnonzero(np.diff(board) == 1)] = 1.0
        seams[row * height] = 1.0
    mix = np.clip(0.5 + 0.16 * grain + 0.24 * tone, 0.0, 1.0)
    wood = ramp(mix, [(0.0, dark), (1.0, light)])
    return np.asarray(wood * (1.0 - 0.32 * seams[..., None]) / rgb(light), dtype=np.float64)


def oak_planks(rng: np.random.Generator) -> Floats:
    """Paint warm oak boards, tinted with d3ab7c."""
    return _planks(rng, "d3ab7c", "ad8152")


def pine_planks(rng: np.random.Generator) -> Floats:
    """Paint pale pine boards, tinted with e3cfab."""
    return _planks(rng, "e3cfab", "c9ad80")


def wood_grain(rng: np.random.Generator) -> Floats:
    """Paint grey furniture wood with the grain along x."""
    bands = noise(rng, (256, 256), roll_off=1.3, stretch=10.0)
    fibres = noise(rng, (256, 256), roll_off=0.3, stretch=30.0)
    return 0.86 + 0.055 * np.sin(bands * 2.2) + 0.02 * fibres


def kitchen_tiles(rng: np.random.Generator) -> Floats:
    """Paint 4 x 4 square stone tiles, tinted with cbc4b8."""
    shape = (256, 256)
    tone = 0.5 + 0.22 * tile_tones(rng, shape, 4, 4) + 0.1 * noise(rng, shape, roll_off=1.2)
    stone = ramp(np.clip(tone, 0.0, 1.0), [(0.0, "a9a196"), (1.0, "cbc4b8")])
    tiles = blend(stone, "8d867c", joints(shape, 4, 4, 2.4))
    return np.asarray(tiles / rgb("cbc4b8"), dtype=np.float64)


def bath_tiles(rng: np.random.Generator) -> Floats:
    """Paint a checkerboard of 4 x 4 white and pale sea-green tiles."""
    shape = (256, 256)
    x, y = grid(shape)
    checker = (np.floor(x * 4) + np.floor(y * 4)) % 2
    tone = 0.02 * noise(rng, shape, roll_off=1.0)
    base = ramp(checker, [(0.0, "e9efee"), (1.0, "b4cccb")]) + tone[..., None]
    return blend(base, "c7cecd", joints(shape, 4, 4, 2.2))


def metro_tiles(rng: np.random.Generator) -> Floats:
    """Paint grey glazed wall tiles in a running bond, with 8 rows of 4."""
    shape = (256, 256)
    glaze = 0.95 + 0.02 * tile_tones(rng, shape, 8, 4, 0.5) + 0.004 * noise(rng, shape, roll_off=0.8)
    return np.asarray(glaze * (1.0 - 0.16 * joints(shape, 8, 4, 2.4, 0.5)), dtype=np.float64)


def bricks(rng: np.random.Generator) -> Floats:
    """Paint a whitewashed brick wall with 12 rows of 4 bricks."""
    shape = (256, 256)
    tone = 0.5 + 0.3 * tile_tones(rng, shape, 12, 4, 0.5) + 0.16 * noise(rng, shape, roll_off=0.9)
    clay = ramp(np.clip(tone, 0.0, 1.0), [(0.0, "a8644c"), (1.0, "c98b70")])
    return blend(clay, "cfc4b6", joints(shape, 12, 4, 3.4, 0.5))


def marble(rng: np.random.Generator) -> Floats:
    shape = (256, 256)
    warp = noise(rng, shape, roll_off=1.6)
    veins = np.exp(-np.abs(noise(rng, shape, roll_off=1.7) + 0.25 * warp) * 9.0)
    tone = np.clip(0.75 - 0.55 * veins + 0.08 * warp, 0.0, 1.0)
    return ramp(tone, [(0.0, "8c8d90"), (0.7, "dedcd8"), (1.0, "f2f0ec")])


def brushed_steel(rng: np.random.Generator) -> Floats:
    """Paint grey metal that is brushed along x."""
    return 0.92 + 0.012 * noise(rng, (128, 128), roll_off=0.5, stretch=40.0)


def leaves(rng: np.random.Generator) -> Floats:
    """Paint foliage of many small leaves, tinted with 79ac55."""
    shape = (256, 256)
    dark, light = rgb("24502a"), rgb("79ac55")
    image = (flat(shape, "21452a") * 255).astype(np.uint8)
    for _ in range(420):
        x, y = (int(v) for v in rng.integers(0, 256, 2))
        axes = (int(rng.integers(9, 17)), int(rng.integers(4, 7)))
        colour = (dark + (light - dark) * rng.uniform()) * 255
        angle = float(rng.uniform(0, 180))
        for dx in (-256, 0, 256):
            for dy in (-256, 0, 256):
                cv2.ellipse(image, (x + dx, y + dy), axes, angle, 0, 360, colour.tolist(), -1, cv2.LINE_AA)
    return np.asarray(image / 255.0 / light, dtype=np.float64)


def polka_dots(rng: np.random.Generator) -> Floats:
    """Paint a pale yellow wallpaper with staggered white, orange and teal dots."""
    shape = (256, 256)
    image = flat(shape, "fae7b8") + 0.006 * noise(rng, shape, roll_off=0.8)[..., None]
    for index in range(16):
        row, column = divmod(index, 4)
        centre = ((column + 0.25 + 0.5 * (row % 2)) / 4, (row + 0.5) / 4)
        code = ("ffffff", "f0b06a", "ffffff", "8cc5bf")[(index + row // 2) % 4]
        image = disc(image, code, centre, 0.026)
    return image


def damask(rng: np.random.Generator) -> Floats:
    """Paint a grey wallpaper of interlocking leaf-shaped lozenges."""
    shape = (256, 256)
    x, y = grid(shape)
    motif = (
        np.cos(x * 4 * np.pi) + np.cos(y * 4 * np.pi) + 0.5 * np.cos(x * 8 * np.pi) * np.cos(y * 8 * np.pi)
    )
    return 0.95 + 0.02 * np.tanh(3.0 * motif) + 0.006 * noise(rng, shape, roll_off=1.0)


def _black_with_alpha(alpha: Floats) -> Floats:
    """Return a black RGBA image with the given opacity."""
    return np.concatenate([np.zeros((*alpha.shape, 3)), alpha[..., None]], axis=-1)


def shadow_box(rng: np.random.Generator) -> Floats:  # noqa: ARG001 (all painters take a generator)
    """Paint the contact shadow of a box that covers the middle 80 % of the image, as RGBA."""
    x, y = grid((128, 128))
    inside = smooth_step(np.minimum(x, 1 - x), 0.0, 0.2) * smooth_step(np.minimum(y, 1 - y), 0.0, 0.2)
    return _black_with_alpha(0.38 * inside)


def shadow_round(rng: np.random.Generator) -> Floats:  # noqa: ARG001
    """Paint the contact shadow of a round object, as RGBA."""
    x, y = grid((128, 128))
    return _black_with_alpha(0.38 * (1.0 - smooth_step(np.hypot(x - 0.5, y - 0.5), 0.15, 0.5)))


def shadow_edge(rng: np.random.Generator) -> Floats:  # noqa: ARG001
    """Paint the shadow in a corner of the room as RGBA. It is darkest at the lower edge of the image."""
    x, y = grid((64, 64))
    ends = smooth_step(np.minimum(x, 1 - x), 0.0, 0.1)
    # The last rows are hidden by the skirting board. They are transparent because the texture wraps around.
    return _black_with_alpha(np.where(y < 0.95, 0.3 * ends * y**2, 0.0))


TEXTURES: Mapping[str, Painter] = {
    painter.__name__: painter
    for painter in (
        oak_planks, pine_planks, wood_grain, kitchen_tiles, bath_tiles, metro_tiles, bricks, marble, brushed_steel,
        leaves, polka_dots, damask, *textiles.TEXTILES, shadow_box, shadow_round, shadow_edge, *artwork.PICTURES,
    )
}  # fmt: skip


def paint(name: str) -> NDArray[np.uint8]:
    """Return texture `name` as bytes of shape (height, width), (height, width, 3) or (height, width, 4).

    Raises:
        AssetError: There is no texture with this name.
    """
    if name not in TEXTURES:
        raise AssetError(f"no texture is called {name!r}; use one of {', '.join(sorted(TEXTURES))}")
    return to_bytes(TEXTURES[name](np.random.default_rng(zlib.crc32(name.encode()))))


def build_textures(folder: Path) -> list[Path]:
    paths = []
    for name in TEXTURES:
        image = paint(name)
        if image.ndim == 3:
            image = cv2.cvtColor(image, cv2.COLOR_RGB2BGR if image.shape[2] == 3 else cv2.COLOR_RGBA2BGRA)
        path = folder / f"{name}.png"
        with replacing(path) as temporary:
            cv2.imwrite(str(temporary), image, [cv2.IMWRITE_PNG_COMPRESSION, 9])
        paths.append(path)
    return paths
