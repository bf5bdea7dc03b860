"""Paint the textiles of the apartment: carpet, cloth, bed linen and rugs (see `tools.authoring.textures`)."""

import numpy as np

from tools.authoring.patterns import Floats, blend, flat, grid, joints, noise, rgb, smooth_step


def carpet(rng: np.random.Generator) -> Floats:
    """Paint a grey carpet with a short pile."""
    fine = noise(rng, (256, 256), roll_off=0.35)
    return 0.9 + 0.028 * fine + 0.014 * noise(rng, (256, 256), roll_off=1.4)


def fabric(rng: np.random.Generator) -> Floats:
    """Paint a grey fabric with a plain weave."""
    x, y = grid((256, 256))
    weave = np.sin(x * 2 * np.pi * 48) * np.sin(y * 2 * np.pi * 48)
    return 0.9 + 0.04 * weave + 0.03 * noise(rng, (256, 256), roll_off=0.6)


def towel(rng: np.random.Generator) -> Floats:
    """Paint grey terry cloth with a woven border near its lower edge."""
    shape = (256, 256)
    _, y = grid(shape)
    border = ((y > 0.80) & (y < 0.83)) | ((y > 0.86) & (y < 0.89))
    return 0.92 + 0.03 * noise(rng, shape, roll_off=0.3) - 0.16 * border


def curtain(rng: np.random.Generator) -> Floats:
    """Paint a grey curtain with vertical folds."""
    x, _ = grid((128, 256))
    phase = 0.25 * np.repeat(noise(rng, (1, 256), roll_off=1.5), 128, axis=0)
    folds = np.sin(x * 2 * np.pi * 7 + phase)
    return 0.84 + 0.13 * folds + 0.03 * np.sin(x * 2 * np.pi * 23)


def stripes(rng: np.random.Generator) -> Floats:
    """Paint white bed linen with blue pinstripes."""
    x, _ = grid((256, 256))
    lines = smooth_step(np.abs((x * 8) % 1.0 - 0.5), 0.34, 0.40)
    cloth = flat((256, 256), "eef0f2") + 0.012 * noise(rng, (256, 256), roll_off=0.7)[..., None]
    return blend(cloth, "6f8fb8", lines)


def quilt(rng: np.random.Generator) -> Floats:
    """Paint a child's quilt of 4 x 4 coloured patches with stitched edges."""
    shape = (256, 256)
    palette = [rgb(code) for code in ("f2c14e", "5fb3b3", "ee8572", "f6ead2", "7fa6d6", "a7c66a")]
    picks = np.array([[(3 * row + 2 * column) % 6 for column in range(4)] for row in range(4)])
    x, y = grid(shape)
    image = np.asarray(palette)[picks[(y * 4).astype(int), (x * 4).astype(int)]]
    image = image + 0.02 * noise(rng, shape, roll_off=0.8)[..., None]
    dots = ((x * 32) % 1.0 < 0.5) & ((y * 32) % 1.0 < 0.5)
    return blend(image, "ffffff", 0.75 * joints(shape, 4, 4, 5.0) * dots)


def _framed_rug(shape: tuple[int, int], field: Floats, bands: list[tuple[float, str]]) -> Floats:
    """Paint borders around `field`. Each border starts at a distance from the edge, in image heights."""
    x, y = grid(shape)
    edge = np.minimum(np.minimum(x, 1 - x) * shape[1] / shape[0], np.minimum(y, 1 - y))
    image = field
    for inner, colour in bands:
        image = blend(image, colour, 1.0 - smooth_step(edge, inner - 0.004, inner + 0.004))
    return image


def rug_living(rng: np.random.Generator) -> Floats:
    """Paint a cream and blue rug with lozenges."""
    shape = (256, 384)
    x, y = grid(shape)
    u, v = (x * 6) % 1.0 - 0.5, (y * 4) % 1.0 - 0.5
    lozenge = np.abs(u) + np.abs(v)
    field = flat(shape, "d9d2c3")
    field = blend(field, "5f7d95", smooth_step(-np.abs(lozenge - 0.42), -0.06, -0.03))
    field = blend(field, "c58f5c", smooth_step(-lozenge, -0.14, -0.10))
    image = _framed_rug(shape, field, [(0.10, "e4dccb"), (0.08, "48637b"), (0.02, "d9d2c3")])
    return image + 0.025 * noise(rng, shape, roll_off=0.4)[..., None]


def rug_round(rng: np.random.Generator) -> Floats:
    """Paint a round rug of concentric rings as RGBA, with transparent corners."""
    shape = (256, 256)
    x, y = grid(shape)
    radius = np.hypot(x - 0.5, y - 0.5) * 2
    colours = ("f6ead2", "5fb3b3", "f6ead2", "f2c14e", "f6ead2", "ee8572")
    image = np.asarray([rgb(code) for code in colours])[np.minimum((radius * 6).astype(int), 5)]
    pile = image + 0.02 * noise(rng, shape, roll_off=0.4)[..., None]
    return np.concatenate([pile, 1.0 - smooth_step(radius, 0.985, 1.0)[..., None]], axis=-1)


def rug_runner(rng: np.random.Generator) -> Floats:
    """Paint a red hall runner with a border."""
    shape = (128, 512)
    x, y = grid(shape)
    u, v = (x * 16) % 1.0 - 0.5, (y * 4) % 1.0 - 0.5
    field = blend(flat(shape, "8e3b34"), "c9a26a", smooth_step(-np.abs(u) - np.abs(v), -0.2, -0.14))
    image = _framed_rug(shape, field, [(0.15, "d8bf92"), (0.11, "5c2a2c"), (0.03, "8e3b34")])
    return image + 0.02 * noise(rng, shape, roll_off=0.4)[..., None]


def rug_bedroom(rng: np.random.Generator) -> Floats:
    """Paint a shaggy ivory rug."""
    return flat((256, 256), "ded7cc") + 0.045 * noise(rng, (256, 256), roll_off=0.8)[..., None]


TEXTILES = (
    carpet, fabric, towel, curtain, stripes, quilt, rug_living, rug_round, rug_runner, rug_bedroom,
)  # fmt: skip
