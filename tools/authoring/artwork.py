"""Paint procedural pictures for the apartment: the view outside, framed art, screens and book spines.

Each painter is a function that takes a random generator and returns an RGB image of floats in [0, 1].
"""

import cv2
import numpy as np

from tools.authoring.patterns import Floats, blend, disc, flat, grid, noise, polygon, ramp, rgb, smooth_step


def garden(rng: np.random.Generator) -> Floats:
    """Paint the view from a window: sky with clouds, trees, a hedge and a lawn. The image repeats along x."""
    shape = (256, 512)
    _, y = grid(shape)
    image = ramp(y, [(0.0, "7fb6e6"), (0.5, "d8ecf7"), (1.0, "e8f3f8")])
    clouds = noise(rng, shape, roll_off=1.7, stretch=2.2)
    image = blend(image, "ffffff", 0.85 * smooth_step(clouds, 0.3, 1.6) * (1 - y))
    layers = (("a9c6b4", 0.50, 0.035, 1.6), ("6f9f6c", 0.58, 0.05, 1.2), ("4c7f4d", 0.69, 0.016, 0.9))
    for code, level, height, roll_off in layers:
        outline = level + height * noise(rng, (1, 512), roll_off=roll_off)
        mottle = 1 + 0.07 * noise(rng, shape, roll_off=0.9)
        mask = smooth_step(y - outline, 0.0, 0.01)
        image = image * (1 - mask[..., None]) + rgb(code) * (mask * mottle)[..., None]
    lawn = ramp(y, [(0.76, "88b862"), (1.0, "a8cf7c")])
    lawn = lawn * (1 + 0.04 * noise(rng, shape, roll_off=0.6))[..., None]
    mask = smooth_step(y, 0.76, 0.78)[..., None]
    return np.asarray(image * (1 - mask) + lawn * mask, dtype=np.float64)


def art_hills(rng: np.random.Generator) -> Floats:
    """Paint layered hills under a large sun."""
    shape = (256, 384)
    _, y = grid(shape)
    image = ramp(y, [(0.0, "f4d6a5"), (0.7, "f0a878")])
    image = disc(image, "fbf1d8", (0.68, 0.34), 0.16)
    for index, code in enumerate(("c97b6a", "8f5a6b", "56486b", "2e3555")):
        outline = 0.46 + 0.13 * index + 0.07 * noise(rng, (1, 384), roll_off=2.0)
        image = blend(image, code, smooth_step(y - outline, 0.0, 0.008))
    return image


def art_sea(rng: np.random.Generator) -> Floats:
    """Paint a sailing boat at sea."""
    shape = (256, 384)
    _, y = grid(shape)
    image = ramp(y, [(0.0, "8cc4e8"), (0.55, "e3f1f2"), (0.551, "2f7fa3"), (1.0, "14425f")])
    waves = noise(rng, shape, roll_off=1.0, stretch=8.0)
    image = blend(image, "bfe3ea", 0.5 * smooth_step(waves, 0.8, 1.8) * (y > 0.56))
    image = polygon(image, "fdfbf5", [(0.50, 0.16), (0.50, 0.62), (0.66, 0.62)])
    image = polygon(image, "e2574c", [(0.485, 0.22), (0.485, 0.62), (0.37, 0.62)])
    hull = [(0.34, 0.645), (0.70, 0.645), (0.64, 0.73), (0.40, 0.73)]
    return polygon(image, "6b3f2a", hull)


def art_shapes(rng: np.random.Generator) -> Floats:
    """Paint overlapping discs and bars in a few flat colours."""
    shape = (256, 256)
    image = flat(shape, "f0e9dc") + 0.006 * noise(rng, shape, roll_off=0.8)[..., None]
    image = disc(image, "d8572a", (0.38, 0.40), 0.24)
    image = disc(image, "1f3b4d", (0.64, 0.60), 0.20, 0.92)
    image = polygon(image, "e8b04a", [(0.1, 0.72), (0.9, 0.66), (0.9, 0.71), (0.1, 0.77)])
    return polygon(image, "1f3b4d", [(0.18, 0.1), (0.22, 0.1), (0.22, 0.9), (0.18, 0.9)])


def art_leaf(rng: np.random.Generator) -> Floats:
    """Paint a botanical print of a stem with paired leaves."""
    shape = (384, 256)
    image = flat(shape, "f3efe4") + 0.006 * noise(rng, shape, roll_off=0.8)[..., None]
    image = polygon(image, "4d6b45", [(0.49, 0.1), (0.51, 0.1), (0.515, 0.9), (0.485, 0.9)])
    for index in range(5):
        base = 0.78 - 0.13 * index
        reach = 0.33 - 0.035 * index
        for side in (-1.0, 1.0):
            leaf = [
                (0.5, base),
                (0.5 + side * reach * 0.45, base - 0.10),
                (0.5 + side * reach, base - 0.12),
                (0.5 + side * reach * 0.62, base - 0.02),
            ]
            colour = "6f9a5c" if side > 0 else "557f4b"
            image = polygon(image, colour, leaf)
    return image


def poster_rocket(rng: np.random.Generator) -> Floats:
    """Paint a child's poster of a rocket among planets and stars."""
    shape = (384, 256)
    image = ramp(grid(shape)[1], [(0.0, "1d2a5b"), (1.0, "3b4c93")])
    for _ in range(40):
        centre = (float(rng.uniform()), float(rng.uniform()))
        image = disc(image, "fff6d6", centre, float(rng.uniform(0.003, 0.007)))
    image = disc(image, "f2a65a", (0.22, 0.2), 0.09)
    image = disc(image, "7fd1c7", (0.8, 0.74), 0.07)
    body = [(0.5, 0.22), (0.60, 0.36), (0.62, 0.62), (0.38, 0.62), (0.40, 0.36)]
    image = polygon(image, "f4f4f0", body)
    image = polygon(image, "e2574c", [(0.5, 0.16), (0.605, 0.36), (0.395, 0.36)])
    for side in (-1.0, 1.0):
        fin = [(0.5 + side * 0.12, 0.5), (0.5 + side * 0.25, 0.7), (0.5 + side * 0.12, 0.64)]
        image = polygon(image, "e2574c", fin)
    image = polygon(image, "f9c846", [(0.43, 0.63), (0.57, 0.63), (0.5, 0.82)])
    return disc(image, "4aa3c7", (0.5, 0.44), 0.035)


def _panel(image: Floats, box: tuple[float, float, float, float], code: str) -> Floats:
    """Fill a rectangle given by (left, top, right, bottom), as fractions of the image size."""
    left, top, right, bottom = box
    corners = [(left, top), (right, top), (right, bottom), (left, bottom)]
    return polygon(image, code, corners)


def screen_desktop(rng: np.random.Generator) -> Floats:
    """Paint a computer screen with a wallpaper, an editor window, a chart and a task bar."""
    shape = (144, 256)
    x, y = grid(shape)
    image = ramp((x + y) / 2, [(0.0, "1f4e79"), (1.0, "4f9fb5")])
    image = _panel(image, (0.06, 0.10, 0.58, 0.84), "f6f6f4")
    image = _panel(image, (0.06, 0.10, 0.58, 0.16), "3a4a5a")
    for row in range(9):
        top = 0.21 + 0.067 * row
        indent = 0.09 + 0.03 * int(rng.integers(0, 3))
        code = ("555f6b", "3d7ea6", "a65a3d")[int(rng.integers(0, 3))]
        image = _panel(image, (indent, top, indent + float(rng.uniform(0.15, 0.38)), top + 0.025), code)
    image = _panel(image, (0.63, 0.18, 0.94, 0.66), "ffffff")
    for bar in range(5):
        left = 0.66 + 0.053 * bar
        image = _panel(image, (left, 0.62 - 0.38 * float(rng.uniform(0.3, 1)), left + 0.036, 0.62), "e08a3c")
    return _panel(image, (0.0, 0.92, 1.0, 1.0), "1b2733")


def keyboard(rng: np.random.Generator) -> Floats:  # noqa: ARG001 (all painters take a generator)
    image = flat((96, 256), "2b2d30")
    for row in range(5):
        for column in range(15):
            wide = 5 if (row == 4 and column == 4) else 1
            if row == 4 and 4 < column < 9:
                continue
            left, top = 0.025 + column * 0.0635, 0.07 + row * 0.178
            image = _panel(image, (left, top, left + 0.0635 * wide - 0.012, top + 0.14), "dcdcd8")
    return image


def piano_keys(rng: np.random.Generator) -> Floats:  # noqa: ARG001
    """Paint four octaves of a piano keyboard seen from above."""
    image = flat((64, 512), "f4f2ec")
    whites = 28
    for key in range(whites):
        left = key / whites
        image = _panel(image, (left - 0.001, 0.0, left + 0.001, 1.0), "8d8b86")
        if key % 7 not in (0, 3):
            image = _panel(image, (left - 0.009, 0.0, left + 0.009, 0.62), "17171a")
    return image


def book_spines(rng: np.random.Generator) -> Floats:
    """Paint a row of books with coloured spines of different sizes and title bands."""
    shape = (128, 512)
    image = flat(shape, "2a211b")
    codes = (
        "8c2f2b",
        "2f4f6f",
        "3f6b4a",
        "c59b4a",
        "5b3f66",
        "d9d0bd",
        "b5623a",
        "27343f",
        "7f9aa3",
        "e0b7a0",
    )
    left = 2
    while left < shape[1] - 8:
        width = int(rng.integers(11, 26))
        top = int(rng.integers(4, 34))
        right = min(left + width, shape[1] - 2)
        colour = rgb(codes[int(rng.integers(len(codes)))])
        across = np.linspace(-1.0, 1.0, right - left)
        image[top:, left:right] = colour * (1.0 - 0.28 * across**2)[None, :, None]
        band = top + int(rng.integers(8, 24))
        image[band : band + int(rng.integers(4, 22)), left + 2 : right - 2] = 0.25 * colour + 0.7
        left = right + 1
    return image


def clock_face(rng: np.random.Generator) -> Floats:  # noqa: ARG001
    """Paint a wall clock that shows ten past ten, on a square image."""
    shape = (192, 192)
    image = disc(flat(shape, "30343a"), "f7f5ef", (0.5, 0.5), 0.45)
    pixels = np.ascontiguousarray((image * 255).astype(np.uint8))
    for hour in range(12):
        turn = hour * np.pi / 6
        direction = np.array([np.sin(turn), -np.cos(turn)])
        start, end = (96 + direction * 72).astype(int), (96 + direction * 81).astype(int)
        cv2.line(pixels, start.tolist(), end.tolist(), (48, 52, 58), 4 if hour % 3 == 0 else 2, cv2.LINE_AA)
    for turn, length, width in ((10.17 * np.pi / 6, 42, 6), (2 * np.pi / 6, 62, 4)):
        tip = (96 + np.array([np.sin(turn), -np.cos(turn)]) * length).astype(int)
        cv2.line(pixels, (96, 96), tip.tolist(), (32, 36, 42), width, cv2.LINE_AA)
    return pixels / 255.0


def mirror(rng: np.random.Generator) -> Floats:  # noqa: ARG001
    """Paint a pale gradient with two slanted highlights, which looks like a mirror without reflections."""
    shape = (128, 128)
    x, y = grid(shape)
    image = ramp((x + y) / 2, [(0.0, "cfdde3"), (0.5, "aebfc8"), (1.0, "c7d3d8")])
    for left, width in ((0.15, 0.16), (0.42, 0.05)):
        band = [(left + 0.3, 0.0), (left + 0.3 + width, 0.0), (left + width - 0.1, 1.0), (left - 0.1, 1.0)]
        image = polygon(image, "e9f2f5", band, 0.7)
    return image


def pinboard(rng: np.random.Generator) -> Floats:
    """Paint a cork board with notes, a photograph and a calendar."""
    shape = (192, 288)
    image = flat(shape, "b98a58") * (1 + 0.05 * noise(rng, shape, roll_off=0.3))[..., None]
    notes = (
        (0.06, 0.10, 0.26, 0.42, "f7e27a"),
        (0.32, 0.08, 0.52, 0.38, "f5f4ef"),
        (0.10, 0.54, 0.32, 0.90, "f4b6a6"),
        (0.38, 0.48, 0.58, 0.88, "a9d6c2"),
        (0.64, 0.12, 0.94, 0.84, "fbfaf6"),
    )
    for left, top, right, bottom, code in notes:
        image = _panel(image, (left, top, right, bottom), code)
        image = disc(image, "c8372d", ((left + right) / 2, top + 0.03), 0.022)
    image = _panel(image, (0.64, 0.17, 0.94, 0.28), "c8372d")
    for cell in range(24):
        left, top = 0.66 + 0.044 * (cell % 6), 0.34 + 0.12 * (cell // 6)
        image = _panel(image, (left, top, left + 0.03, top + 0.07), "c9ccd0")
    return image


PICTURES = (
    garden, art_hills, art_sea, art_shapes, art_leaf, poster_rocket, screen_desktop, keyboard, piano_keys,
    book_spines, clock_face, mirror, pinboard,
)  # fmt: skip
