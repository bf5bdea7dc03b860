"""Primitives for procedural textures: periodic noise, colour ramps, tilings and painted shapes.

Images are arrays of floats in [0, 1], with shape (height, width) or (height, width, 3) for RGB.
"""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def rgb(code: str) -> Floats:
    """Convert a hexadecimal colour such as `c8a06e` to three floats in [0, 1]."""
    return np.array([int(code[i : i + 2], 16) / 255.0 for i in (0, 2, 4)])


def noise(
    rng: np.random.Generator, shape: tuple[int, int], *, roll_off: float = 1.0, stretch: float = 1.0
) -> Floats:
    """Return periodic noise (height, width) with mean 0, deviation 1 and amplitudes of 1 / f**`roll_off`.

    Its features are `stretch` times as wide as they are high.
    """
    spectrum = np.fft.fft2(rng.standard_normal(shape))
    vertical = np.fft.fftfreq(shape[0])[:, None]
    horizontal = np.fft.fftfreq(shape[1])[None, :] * stretch
    frequency = np.hypot(vertical, horizontal)
    frequency[0, 0] = np.inf
    field = np.fft.ifft2(spectrum / frequency**roll_off).real
    return np.asarray(field / field.std(), dtype=np.float64)


def grid(shape: tuple[int, ...]) -> tuple[Floats, Floats]:
    """Return the x and y coordinates of all pixel centres, each (height, width), in [0, 1]. y points down."""
    y, x = np.mgrid[0 : shape[0], 0 : shape[1]]
    return (x + 0.5) / shape[1], (y + 0.5) / shape[0]


def smooth_step(value: Floats, low: float, high: float) -> Floats:
    """Interpolate smoothly between 0 at `low` and 1 at `high`."""
    t = np.clip((value - low) / (high - low), 0.0, 1.0)
    return np.asarray(t * t * (3.0 - 2.0 * t), dtype=np.float64)


def ramp(value: Floats, stops: Sequence[tuple[float, str]]) -> Floats:
    """Map values (height, width) to colours (height, width, 3) by linear interpolation between `stops`."""
    positions = [stop for stop, _ in stops]
    channels = [np.interp(value, positions, [rgb(code)[i] for _, code in stops]) for i in range(3)]
    return np.stack(channels, axis=-1)


def flat(shape: tuple[int, int], code: str) -> Floats:
    return np.broadcast_to(rgb(code), (*shape, 3)).copy()


def blend(image: Floats, code: str, mask: Floats) -> Floats:
    """Paint a colour over an RGB image where `mask` (height, width) is 1."""
    weight = np.clip(mask, 0.0, 1.0)[..., None]
    return np.asarray(image * (1.0 - weight) + rgb(code) * weight, dtype=np.float64)


def polygon(image: Floats, code: str, outline: Sequence[tuple[float, float]], opacity: float = 1.0) -> Floats:
    """Paint an antialiased polygon over an RGB image. Coordinates are fractions of the width and height."""
    shape = image.shape[:2]
    scale = np.array([shape[1], shape[0]]) * 16.0
    points = np.round(np.asarray(outline) * scale).astype(np.int32)
    mask = np.zeros(shape, np.uint8)
    cv2.fillPoly(mask, [points], 255, cv2.LINE_AA, 4)
    return blend(image, code, opacity * (mask / 255.0))


def disc(
    image: Floats, code: str, centre: tuple[float, float], radius: float, opacity: float = 1.0
) -> Floats:
    """Paint an antialiased disc over an RGB image. The radius is a fraction of the image height."""
    shape = image.shape[:2]
    x, y = grid(shape)
    distance = np.hypot((x - centre[0]) * shape[1] / shape[0], y - centre[1])
    mask = 1.0 - smooth_step(distance, radius - 0.75 / shape[0], radius + 0.75 / shape[0])
    return blend(image, code, opacity * mask)


def joints(shape: tuple[int, int], rows: int, columns: int, width: float, offset: float = 0.0) -> Floats:
    """Return a mask (height, width) of the joints between tiles. Odd rows are shifted by `offset` tiles."""
    x, y = grid(shape)
    row = np.floor(y * rows)
    u = (x * columns + offset * (row % 2)) % 1.0
    v = (y * rows) % 1.0
    across = np.minimum(u, 1.0 - u) * shape[1] / columns
    down = np.minimum(v, 1.0 - v) * shape[0] / rows
    return 1.0 - smooth_step(np.minimum(across, down), width / 2.0 - 0.5, width / 2.0 + 0.5)


def tile_tones(
    rng: np.random.Generator, shape: tuple[int, int], rows: int, columns: int, offset: float = 0.0
) -> Floats:
    """Return a random value in [-1, 1] for each tile of `joints`, as an image (height, width)."""
    tones = rng.uniform(-1.0, 1.0, (rows, columns))
    x, y = grid(shape)
    row = np.floor(y * rows).astype(int)
    column = np.floor(x * columns + offset * (row % 2)).astype(int) % columns
    return np.asarray(tones[row, column], dtype=np.float64)


def to_bytes(image: Floats) -> NDArray[np.uint8]:
    return np.round(np.clip(image, 0.0, 1.0) * 255.0).astype(np.uint8)
