"""Write the files of an imported house. Equal houses always give identical files."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np
import trimesh

from mjsim.formats.scene.source_scene import Bin
from mjsim.formats.scene.surface import Floats
from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.catalogue.house_ref import CATALOGUE, models_root
from mjsim.importing.house.drawn_meshes import DrawnMesh, picture_key
from mjsim.importing.house.floor_grid import FloorGrid
from mjsim.importing.house.rooms import Rooms
from mjsim.importing.house.solids import Solid
from mjsim.importing.object.model_writer import comment, numbers, obj_lines, write_png
from mjsim.support.toml import toml_tables

MODEL = "house.xml"
MESHES = "meshes"
_HEIGHT = 2.5  # height of the boxes around the rooms, in metres
_DEPTH = 0.1  # thickness of the colliding floor, in metres
# Depth of the added floor below z = 0, in metres. The floor must not hide rugs and floors of the source.
_UNDER = 0.002
_LIGHTS = (("0 0 -1", 0.25), ("0.7 1 -0.5", 0.28), ("-1 -0.7 -0.5", 0.25), ("0.2 0.5 1", 0.3))


@dataclass(frozen=True, eq=False)
class ImportedHouse:
    """An imported house that can be written to files."""

    label: str  # name of the house shown to participants
    source: str  # name of the source file
    solids: Sequence[Solid]
    looks: Sequence[DrawnMesh]
    grid: FloorGrid
    rooms: Rooms
    bins: Sequence[Bin]
    floor_seen: bool  # True if the source draws most of the floor


def write_house(house: ImportedHouse, folder: Path, catalogue: Catalogue) -> Path:
    """Write a house with the objects of a catalogue to a folder. Return the path of the new catalogue."""
    (folder / MESHES).mkdir()
    lines = [
        f"<mujoco model={quoteattr(_name(house.label))}>",
        f"  <!-- {comment(house.label)}, imported from {comment(house.source)}; conventions in docs/models.md. -->",
        f'  <compiler angle="radian" meshdir="{MESHES}" texturedir="{MESHES}"/>',
        '  <visual><headlight ambient="0.5 0.5 0.5" diffuse="0.05 0.05 0.05" specular="0 0 0"/></visual>',
        "  <default>",
        '    <geom type="box" solref="0.008 1"/>',
        '    <site type="box" group="5" rgba="0 0 0 0"/>',
        '    <light type="directional" castshadow="false" specular="0 0 0"/>',
        '    <default class="solid"><geom group="3"/></default>',
        '    <default class="seen"><geom type="mesh" group="2" contype="0" conaffinity="0"/></default>',
        "  </default>",
        "  <asset>",
        *(f"    {line}" for line in _assets(house, folder / MESHES)),
        "  </asset>",
        "  <worldbody>",
        *(f"    {line}" for line in (*_lights(), *_structure(house), *_geoms(house), *_sites(house))),
        "  </worldbody>",
        "</mujoco>",
    ]
    (folder / MODEL).write_text("\n".join(lines) + "\n", encoding="utf-8")
    path = folder / CATALOGUE
    path.write_text(_catalogue(house, catalogue) + "\n", encoding="utf-8")
    return path


def set_points(catalogue: Path, points: int) -> None:
    """Set in a catalogue file at how many points of the house objects can lie."""
    text = catalogue.read_text(encoding="utf-8")
    catalogue.write_text(text.replace("[house]\n", f"[house]\npoints = {points}\n", 1), encoding="utf-8")


def _assets(house: ImportedHouse, folder: Path) -> Iterator[str]:
    known: set[str] = set()
    for number, mesh in enumerate(house.looks):
        look, name = mesh.visual, f"look_{number}"
        (folder / f"{name}.obj").write_text("\n".join(obj_lines(look)) + "\n", encoding="utf-8")
        yield f'<mesh name="{name}" file="{name}.obj" inertia="shell"/>'
        material = _material(mesh)
        if material in known:
            continue
        known.add(material)
        red, green, blue = look.colour
        texture = ""
        if look.picture is not None:
            picture = f"picture_{picture_key(look)}"
            if picture not in known:
                known.add(picture)
                write_png(folder / f"{picture}.png", look.picture)
                yield f'<texture name="{picture}" type="2d" file="{picture}.png"/>'
            texture = f' texture="{picture}"'
        rgba = f"{red:g} {green:g} {blue:g} 1"
        yield f'<material name="{material}"{texture} rgba="{rgba}" specular="0.1" shininess="0.2"/>'
    for number, solid in enumerate(house.solids):
        if solid.hull is not None:
            text = trimesh.convex.convex_hull(solid.hull).export(file_type="obj", digits=5, header=None)
            (folder / f"hull_{number}.obj").write_text(text, encoding="utf-8")
            yield f'<mesh name="hull_{number}" file="hull_{number}.obj"/>'


def _material(mesh: DrawnMesh) -> str:
    return f"material_{picture_key(mesh.visual)}_" + "_".join(
        f"{round(255 * c):02x}" for c in mesh.visual.colour
    )


def _lights() -> Iterator[str]:
    for direction, strength in _LIGHTS:
        yield f'<light pos="0 0 4" dir="{direction}" diffuse="{strength} {strength} {strength}"/>'


def _structure(house: ImportedHouse) -> Iterator[str]:
    corners = np.array([edge for _, *edges in house.rooms.rectangles(house.grid) for edge in edges])
    low, high = corners.min(axis=0) - 0.2, corners.max(axis=0) + 0.2
    (x, y), (a, b) = (low + high) / 2, (high - low) / 2
    yield f'<geom class="solid" name="floor" pos="{x:.4f} {y:.4f} {-_DEPTH / 2}" size="{a:.4f} {b:.4f} {_DEPTH / 2}"/>'
    if not house.floor_seen:
        yield (
            f'<geom class="seen" type="box" name="floor_seen" pos="{x:.4f} {y:.4f} {-_UNDER - 0.01}" '
            f'size="{a:.4f} {b:.4f} 0.01" rgba="0.72 0.62 0.5 1"/>'
        )
    for number, (low, high) in enumerate(house.rooms.shell(house.grid)):
        yield _box(f"shell_{number}", np.array([*low, 0.0]), np.array([*high, _HEIGHT]))


def _geoms(house: ImportedHouse) -> Iterator[str]:
    for number, solid in enumerate(house.solids):
        name = f"{_name(solid.name)}_{number}"
        if solid.hull is None:
            yield _box(name, solid.low, solid.high)
        else:
            yield f'<geom class="solid" name="{name}" type="mesh" mesh="hull_{number}"/>'
    for number, mesh in enumerate(house.looks):
        group = ' group="1"' if mesh.high else ""
        name = f"{_name(mesh.name)}_look_{number}"
        yield f'<geom class="seen" name="{name}" mesh="look_{number}" material="{_material(mesh)}"{group}/>'


def _sites(house: ImportedHouse) -> Iterator[str]:
    counts: dict[str, int] = {}
    for key, low, high in house.rooms.rectangles(house.grid):
        counts[key] = counts.get(key, -1) + 1
        (x, y), (a, b) = (low + high) / 2, (high - low) / 2
        yield f'<site name="room:{key}:{counts[key]}" pos="{x:.4f} {y:.4f} 1" size="{a:.4f} {b:.4f} 1"/>'
    for place in house.bins:
        at = f"{place.x:.4f} {place.y:.4f} {place.z:.4f}"
        yield f'<site name="mount:{place.key}" pos="{at}" euler="0 0 {place.yaw:.6f}"/>'


def _box(name: str, low: Floats, high: Floats) -> str:
    middle, half = numbers((low + high) / 2, 5), numbers((high - low) / 2, 5)
    return f'<geom class="solid" name="{name}" pos="{middle}" size="{half}"/>'


def _catalogue(house: ImportedHouse, catalogue: Catalogue) -> str:
    bins = {place.key: place for place in house.bins}
    categories = [c for c in catalogue.categories.values() if c.receptacle in bins]
    objects = [key for category in categories for key in category.objects]
    tables: dict[str, dict[str, object]] = {
        "house": {"label": house.label, "model": MODEL},
        "rooms": dict(house.rooms.names),
    }
    for c in categories:
        own = {"label": c.label, "receptacle": c.receptacle}
        tables[f"categories.{c.key}"] = {**own, "objects": list(c.objects)}
    for key, found in bins.items():
        known = catalogue.receptacles[key]
        place = {"place": found.place, "room": found.room}
        tables[f"receptacles.{key}"] = {"label": known.label, **place, "model": _relative(known.path)}
    for key in objects:
        item = catalogue.objects[key]
        tables[f"objects.{key}"] = {"label": item.label, "model": _relative(item.path)}
    return toml_tables(tables)


def _relative(path: Path) -> str:
    root = models_root().resolve()
    resolved = path.resolve()
    return str(resolved.relative_to(root)) if resolved.is_relative_to(root) else str(resolved)


def _name(text: str) -> str:
    return re.sub(r"[^A-Za-z0-9_]+", "_", text).strip("_")[:40] or "thing"
