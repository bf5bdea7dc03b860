"""Plans made by hand, a palette, and a piece as a model of its own."""

import re
from collections.abc import Mapping

import mujoco

from mjsim.generator.furniture.appearance import Appearance
from mjsim.generator.furniture.piece import Piece, flattened
from mjsim.generator.values import Asset, Door, HomePlan, Palette, Rectangle, Room, Window
from mjsim.house.catalogue.house_ref import models_root

PALETTE = Palette(
    woods=((0.8, 0.58, 0.36), (0.5, 0.33, 0.22)),
    fronts=((0.4, 0.53, 0.47), (0.92, 0.91, 0.88)),
    fabrics=((0.3, 0.46, 0.58), (0.9, 0.68, 0.26), (0.62, 0.7, 0.58)),
    accents=((0.8, 0.25, 0.2), (0.25, 0.55, 0.56), (0.96, 0.78, 0.3)),
    metal=(0.2, 0.2, 0.2),
)
BINS = ("dish_bin", "toy_box", "bookshelf", "laundry_hamper", "office_box", "recycling_bin")


def compiled(piece: Piece, look: Appearance) -> mujoco.MjModel:
    """A piece at the origin, with the classes and materials of the apartment."""
    assets: dict[str, Asset] = {}
    bodies = ""
    for member, x, y, yaw in flattened(piece):
        bodies += f'<body pos="{x} {y} 0" euler="0 0 {yaw}">{member.geoms}</body>'
        for asset in (*look.assets_of(member.geoms), *(a for p in member.pictures for a in p.assets)):
            assets[asset.name] = asset
    files = {f"{a.name}.png": a.image for a in assets.values() if a.image is not None}
    folder = models_root() / "textures"
    files |= {path.name: path.read_bytes() for path in folder.glob("*.png")}
    materials = _part("materials.xml").replace(
        "</asset>", "".join(a.xml for a in assets.values()) + "</asset>"
    )
    xml = f"""<mujoco><compiler angle="radian"/>{_part("defaults.xml")}{materials}<worldbody>
        <body name="piece">{bodies or "<geom class='decor' size='.1 .1 .1'/>"}</body></worldbody></mujoco>"""
    return mujoco.MjModel.from_xml_string(xml, _needed(xml, files))


def _needed(xml: str, files: Mapping[str, bytes]) -> dict[str, bytes]:
    return {name: files[name] for name in set(re.findall(r'file="([^"]+)"', xml))}


def _part(name: str) -> str:
    text = (models_root() / "houses" / "apartment" / name).read_text()
    return re.sub("</?mujocoinclude>", "", text)


def _room(key: str, x0: float, y0: float, x1: float, y1: float) -> Room:
    return Room(key, re.sub(r"_\d", "", key), key, Rectangle(x0, y0, x1, y1))


def flat() -> HomePlan:
    """Six rooms on 90 m^2."""
    rooms = (
        _room("hall", 0, 4.12, 9.0, 5.6),
        _room("living_room", 0, 5.72, 5.2, 10.2),
        _room("kitchen", 5.32, 5.72, 9.0, 10.2),
        _room("bedroom", 0, 0, 3.4, 4.0),
        _room("bedroom_2", 3.52, 0, 6.4, 4.0),
        _room("bathroom", 6.52, 0, 9.0, 4.0),
    )
    ways = (
        ("living_room", "north", 2.6, 1.6),
        ("kitchen", "north", 6.2, 0.9),
        ("bedroom", "south", 1.0, 0.9),
        ("bedroom_2", "south", 5.8, 0.9),
        ("bathroom", "south", 7.2, 0.9),
    )
    doors = [Door(("hall", to), side, at, width, 2.05) for to, side, at, width in ways]  # type: ignore[arg-type]
    windows = (
        Window("living_room", "north", 1.5, 1.4, 0.95, 2.15),
        Window("living_room", "west", 8.5, 1.6, 0.9, 2.15),
        Window("kitchen", "north", 7.2, 1.2, 1.05, 2.15),
        Window("bedroom", "south", 1.7, 1.4, 0.95, 2.15),
        Window("bedroom_2", "south", 5.0, 1.2, 0.95, 2.15),
        Window("bathroom", "south", 7.8, 0.7, 1.3, 2.15),
    )
    return HomePlan(rooms, (*doors, Door(("hall",), "west", 4.8, 0.95, 2.1)), windows)


def studio() -> HomePlan:
    """One room and a bathroom."""
    rooms = (_room("studio", 0, 0, 5.6, 5.2), _room("bathroom", 5.72, 0, 7.7, 2.6))
    doors = (Door(("studio", "bathroom"), "east", 1.3, 0.9, 2.05), Door(("studio",), "south", 4.6, 0.95, 2.1))
    windows = (
        Window("studio", "north", 2.8, 1.8, 0.9, 2.15),
        Window("studio", "west", 2.6, 1.4, 0.95, 2.15),
        Window("bathroom", "south", 6.7, 0.6, 1.3, 2.0),
    )
    return HomePlan(rooms, doors, windows)
