"""Choose the colours of furniture, walls and floors in a home at random."""

import colorsys
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from mjsim.generator.values import HomePlan, Palette, Rgb, Room
from mjsim.house.catalogue.generated_names import stream

WET = ("bathroom", "shower_room", "utility")
_WOODS: tuple[tuple[Rgb, ...], ...] = (  # each row contains the wood colours of one home
    ((0.80, 0.58, 0.36), (0.93, 0.80, 0.60), (0.66, 0.46, 0.28)),
    ((0.50, 0.33, 0.22), (0.80, 0.58, 0.36), (0.38, 0.25, 0.17)),
    ((0.93, 0.80, 0.60), (0.93, 0.92, 0.89), (0.80, 0.58, 0.36)),
    ((0.42, 0.36, 0.31), (0.72, 0.62, 0.51), (0.25, 0.23, 0.22)),
    ((0.62, 0.36, 0.22), (0.86, 0.70, 0.48), (0.47, 0.27, 0.16)),
)
_METALS: tuple[Rgb, ...] = ((0.78, 0.80, 0.83), (0.12, 0.12, 0.13), (0.82, 0.66, 0.34), (0.55, 0.56, 0.58))
_PLANKS: tuple[Rgb, ...] = (
    (0.83, 0.67, 0.49),
    (0.89, 0.81, 0.67),
    (0.57, 0.44, 0.34),
    (0.72, 0.66, 0.60),
    (0.76, 0.56, 0.38),
)
# Average colours of the wallpaper textures.
_GROUNDS: Mapping[str, Rgb] = {"damask": (0.95, 0.95, 0.95), "polka_dots": (0.98, 0.9, 0.72)}
_HUES = (0.02, 0.08, 0.11, 0.14, 0.25, 0.38, 0.48, 0.55, 0.60, 0.66, 0.92)  # hues for walls and fabrics


def draw_palette(seed: int) -> Palette:
    rng = stream(seed, "palette")
    hue = _hue(rng)
    woods = _WOODS[int(rng.integers(len(_WOODS)))]
    other = (hue + float(rng.choice((0.08, 0.33, 0.5)))) % 1
    return Palette(
        woods=woods,
        fronts=(_colour(rng, hue, (0.0, 0.25), (0.82, 0.95)), _colour(rng, hue, (0.15, 0.45), (0.35, 0.7))),
        fabrics=(
            _colour(rng, hue, (0.15, 0.5), (0.35, 0.75)),
            _colour(rng, other, (0.1, 0.35), (0.6, 0.9)),
            _colour(rng, 0.1, (0.02, 0.14), (0.82, 0.95)),
            _colour(rng, other, (0.25, 0.6), (0.3, 0.55)),
        ),
        accents=(
            _colour(rng, other, (0.5, 0.8), (0.65, 0.9)),
            _colour(rng, _hue(rng), (0.45, 0.75), (0.6, 0.9)),
        ),
        metal=_METALS[int(rng.integers(len(_METALS)))],
    )


def surfaces(seed: int, plan: HomePlan) -> list[str]:
    """Return MJCF materials for the facade, the front door, and all walls and floors."""
    rng = stream(seed, "surfaces")
    hue, planks = _hue(rng), str(rng.choice(["oak_planks", "pine_planks"]))
    tone = _PLANKS[int(rng.integers(len(_PLANKS)))]
    door = _colour(rng, _hue(rng), (0.1, 0.6), (0.2, 0.75))
    panel = tuple(min(1.0, value * 1.2 + 0.02) for value in door)
    found = [
        f'<material name="entrance" rgba="{rgba(door)}"/>',
        f'<material name="entrance_panel" rgba="{rgba(panel)}"/>',
        '<material name="facade" rgba="0.9 0.88 0.84 1"/>',
    ]
    for room in plan.rooms:
        own = stream(seed, "surfaces", room.key)
        found += [*_wall(room, hue, own), _floor(room, planks, tone, own)]
    return found


def rgba(colour: Sequence[float]) -> str:
    """Format an opaque colour for MJCF."""
    return " ".join(f"{value:.3f}" for value in colour) + " 1"


def _wall(room: Room, hue: float, rng: np.random.Generator) -> Iterator[str]:
    text = paper = ""
    colour = _colour(rng, hue + rng.uniform(-0.06, 0.06), (0.03, 0.22), (0.86, 0.97))
    if room.use in WET:
        text = 'texture="metro_tiles" texuniform="true" texrepeat="2.6 2.6" '
        colour = _colour(rng, _hue(rng), (0.0, 0.1), (0.93, 0.99))
    elif room.use == "bedroom" and rng.random() < 0.4:
        paper, repeat = [("damask", 4.5), ("polka_dots", 2.0)][int(rng.integers(2))]
        text = f'texture="{paper}" texuniform="true" texrepeat="{repeat} {repeat}" '
        colour = _colour(rng, _hue(rng), (0.05, 0.2), (0.86, 0.96))
    ground = _GROUNDS.get(paper, (1.0, 1.0, 1.0))
    plain = colour[0] * ground[0], colour[1] * ground[1], colour[2] * ground[2]
    for name, pattern, shade in (("", text, colour), ("_plain", "", plain)):
        yield f'<material name="wall_{room.key}{name}" {pattern}rgba="{rgba(shade)}" emission="0.1"/>'


def _floor(room: Room, planks: str, tone: Rgb, rng: np.random.Generator) -> str:
    texture, repeat, colour = planks, 1.0, tone
    if room.use in WET or (room.use == "kitchen" and rng.random() < 0.75):
        texture, repeat = str(rng.choice(["kitchen_tiles", "bath_tiles"])), 1.4
        colour = _colour(rng, _hue(rng), (0.0, 0.1), (0.7, 0.95))
    elif room.use in ("bedroom", "office") and rng.random() < 0.45:
        texture, repeat, colour = "carpet", 1.6, _colour(rng, _hue(rng), (0.05, 0.25), (0.45, 0.8))
    return (
        f'<material name="floor_{room.key}" texture="{texture}" texuniform="true" texrepeat="{repeat} {repeat}" '
        f'rgba="{rgba(colour)}"/>'
    )


def _hue(rng: np.random.Generator) -> float:
    return float(rng.choice(_HUES))


def _colour(
    rng: np.random.Generator, hue: float, saturation: tuple[float, float], value: tuple[float, float]
) -> Rgb:
    r, g, b = colorsys.hsv_to_rgb(hue % 1, rng.uniform(*saturation), rng.uniform(*value))
    return float(r), float(g), float(b)
