"""Choose matching materials for all furniture of a home."""

import colorsys
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mjsim.generator.values import Asset, Palette, Rgb

_QUILTS = ("dfe3e8", "9fb3c4", "c9a184", "b9c4a5", "e3d3ad", "8c95ab", "cf9d97", "7f9a97", "e9e2d6")
_STONES = ("f2f0ec", "4b4c50", "c9c2b6", "8b8780", "e2d6c3")
_POTS = ("bd6b4d", "f2f0ea", "5d666b", "d9c3a0", "6f8f8c", "35373a")
_ALWAYS = (
    ("pane", 'rgba="0.8 0.92 0.97 0.2" specular="0.6" shininess="0.8"'),
    ("wicker", 'rgba="0.76 0.6 0.4 1" texture="fabric"'),
    ("leaves_dark", 'rgba="0.33 0.52 0.3 1" texture="leaves" texrepeat="2 1"'),
    ("leaves_pale", 'rgba="0.6 0.7 0.5 1" texture="leaves" texrepeat="2 1"'),
)
_MATERIAL = re.compile(r'material="([^"]+)"')


@dataclass(frozen=True)
class Appearance:
    """The materials of a home's furniture by role. Materials that occur repeatedly are chosen more often."""

    assets: dict[str, Asset]  # assets by material name
    colours: tuple[Rgb, ...]  # colours for rugs and pictures
    woods: tuple[str, ...] = ("wood_a", "wood_a", "wood_a", "wood_b", "wood_b", "wood_c")
    fronts: tuple[str, ...] = ("front_a", "front_a", "front_b", "white")
    cloths: tuple[str, ...] = ("cloth_a", "cloth_a", "cloth_b", "cloth_c", "cloth_d")
    accents: tuple[str, ...] = ("accent_a", "accent_b", "accent_c", "accent_d")
    quilts: tuple[str, ...] = ("quilt_a", "quilt_b", "quilt_c", "quilt_d")
    metals: tuple[str, ...] = ("metal_a", "metal_a", "chrome", "black")

    def assets_of(self, geoms: str) -> tuple[Asset, ...]:
        """Return the assets of the materials that geoms use. Materials of the apartment have no assets."""
        names = sorted(set(_MATERIAL.findall(geoms)))
        return tuple(self.assets[name] for name in names if name in self.assets)


def draw_appearance(palette: Palette, rng: np.random.Generator) -> Appearance:
    assets = {name: Asset(name, f'<material name="{name}" {rest}/>') for name, rest in _ALWAYS}
    fabrics, accents, fronts = (
        [_muted(rgb) for rgb in of] for of in (palette.fabrics, palette.accents, palette.fronts)
    )

    def add(role: str, rgb: Rgb, attributes: str = "") -> None:
        rgba = " ".join(f"{min(max(value, 0.0), 1.0):.3f}" for value in rgb)
        assets[role] = Asset(role, f'<material name="{role}" rgba="{rgba} 1" {attributes}/>')

    def several(roles: str, colours: Sequence[Rgb], attributes: str = "") -> None:
        for i, role in enumerate(roles.split()):
            red, green, blue = colours[i % len(colours)]
            dim = 1 - 0.12 * (i // len(colours))
            add(role, (dim * red, dim * green, dim * blue), attributes)

    def drawn(codes: Sequence[str]) -> list[Rgb]:
        return [_rgb(codes[i]) for i in rng.permutation(len(codes))]

    several("wood_a wood_b wood_c", palette.woods, 'texture="wood_grain"')
    several("front_a front_b", fronts)
    red, green, blue = fronts[0]
    add("front_dark", (0.8 * red, 0.8 * green, 0.8 * blue))
    several("cloth_a cloth_b cloth_c cloth_d", fabrics, 'texture="fabric"')
    several("accent_a accent_b accent_c accent_d", accents)
    add("metal_a", palette.metal, 'specular="0.6" shininess="0.7"')
    quilts = drawn(_QUILTS)
    several("quilt_a quilt_b", quilts, 'texture="fabric"')
    add("quilt_c", (0.98, 0.98, 0.98), f'texture="{rng.choice(("stripes", "quilt", "fabric"))}"')
    add("quilt_d", quilts[2], f'texture="{rng.choice(("damask", "towel", "fabric"))}"')
    several("towel_a towel_b", fabrics[::-1], 'texture="towel"')
    several("pot_a pot_b", drawn(_POTS))
    stones = drawn(_STONES)
    add("stone", stones[0], 'texture="marble"' if rng.random() < 0.5 else "")
    add("tile", stones[1], 'texture="metro_tiles" texuniform="true" texrepeat="2.4 2.4"')
    fabric = np.array(palette.fabrics[int(rng.integers(len(palette.fabrics)))])
    light = fabric * 0.45 + 0.55 * np.array((0.97, 0.94, 0.88))
    add("curtain", (float(light[0]), float(light[1]), float(light[2])), 'texture="curtain"')
    return Appearance(assets, (*fabrics, *accents))


def _muted(rgb: Rgb) -> Rgb:
    """Desaturate a colour. Greens and purples are desaturated most, as they are rarely vivid in homes."""
    hue, saturation, value = colorsys.rgb_to_hsv(*rgb)
    loud = 0.19 < hue < 0.48 or 0.7 < hue < 0.9
    return colorsys.hsv_to_rgb(hue, saturation * (0.55 if loud else 0.9), value * (0.85 if loud else 1.0))


def _rgb(code: str) -> Rgb:
    return int(code[:2], 16) / 255, int(code[2:4], 16) / 255, int(code[4:], 16) / 255
