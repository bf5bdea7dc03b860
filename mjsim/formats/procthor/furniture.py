"""Furniture for imported ProcTHOR houses, which is stretched to the size of the original objects."""

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh

from mjsim.formats.procthor.plan import Thing
from mjsim.formats.scene.mesh_files import primitive
from mjsim.formats.scene.source_scene import ScenePiece
from mjsim.formats.scene.surface import Floats
from mjsim.generator.files import STYLE, used_materials
from mjsim.generator.furniture.appearance import draw_appearance
from mjsim.generator.furniture.catalogue import KINDS
from mjsim.generator.furniture.piece import flattened
from mjsim.generator.palette import draw_palette
from mjsim.generator.values import Asset
from mjsim.house.catalogue.generated_names import stream
from mjsim.house.catalogue.house_ref import models_root
from mjsim.support.files import read_json, read_text
from mjsim.values.errors import AssetError, brief

DATABASE = "asset-database.json"  # ProcTHOR's file of asset types and sizes
_DRAWN = 4  # number of random pieces per furniture type, from which the most similar one is chosen
_STRETCH = math.log(2.2)  # logarithm of the maximum factor by which a side is stretched
_GREY, _BLACK = np.array([0.62, 0.6, 0.57]), np.array([0.08, 0.08, 0.09])
_SCREENS = ("desktop", "microwave", "television")
_Entry = tuple[tuple[str, ...], tuple[float, float, float]]
_CAN: _Entry = ((), (0.45, 0.35, 0.55))
_SHELVES: _Entry = (("bookcase", "low_bookcase", "cube_shelf"), (0.9, 0.35, 1.45))
_PICTURE: _Entry = ((), (0.8, 0.16, 0.6))
# For each type of object, the similar mjsim furniture (none means a box) and the typical size in metres.
_TYPES: Mapping[str, _Entry] = {
    "armchair": (("armchair",), (0.95, 0.9, 0.9)),
    "bathtub": (("bathtub",), (1.7, 0.8, 0.6)),
    "bed": (("double_bed", "single_bed"), (1.4, 2.2, 0.9)),
    "bin": _CAN,
    "bookcase": _SHELVES,
    "bookshelf": _SHELVES,
    "cabinet": (("sideboard", "chest_of_drawers", "larder"), (1.0, 0.5, 1.0)),
    "cart": (("kitchen_trolley",), (0.7, 0.55, 1.3)),
    "chair": (("dining_chair", "office_chair"), (0.5, 0.55, 0.9)),
    "clothesdryer": (("washing_machine",), (0.7, 0.7, 1.05)),
    "coffeetable": (("coffee_table",), (1.15, 0.65, 0.45)),
    "countertop": (("straight_kitchen", "kitchenette"), (2.4, 0.65, 0.95)),
    "desk": (("desk",), (1.4, 0.6, 0.8)),
    "desklamp": ((), (0.25, 0.3, 0.3)),
    "desktop": ((), (0.9, 0.25, 0.55)),
    "diningtable": (("table",), (1.45, 0.95, 0.75)),
    "dogbed": ((), (1.0, 0.8, 0.2)),
    "dresser": (("chest_of_drawers", "sideboard"), (1.2, 0.5, 0.95)),
    "floorlamp": (("floor_lamp",), (0.5, 0.5, 1.85)),
    "footstool": (("pouf", "stool"), (0.35, 0.3, 0.45)),
    "fridge": (("fridge",), (1.0, 0.7, 1.85)),
    "garbagebag": ((), (0.5, 0.5, 0.55)),
    "garbagecan": _CAN,
    "houseplant": (("bush", "snake_plant"), (0.35, 0.4, 0.65)),
    "laundryhamper": ((), (0.55, 0.45, 0.75)),
    "microwave": ((), (0.6, 0.35, 0.35)),
    "ottoman": (("pouf",), (0.85, 0.5, 0.45)),
    "painting": _PICTURE,
    "roomdecor": ((), (0.3, 0.35, 1.3)),
    "safe": ((), (0.4, 0.45, 0.4)),
    "shelvingunit": _SHELVES,
    "sidetable": (("side_table", "bedside_table"), (0.6, 0.4, 0.65)),
    "sink": (("washbasin",), (0.75, 0.65, 1.0)),
    "sofa": (("sofa",), (2.3, 0.95, 0.9)),
    "stool": (("stool", "bar_stool"), (0.4, 0.35, 0.65)),
    "television": ((), (1.15, 0.2, 0.8)),
    "toilet": (("toilet",), (0.55, 0.75, 0.9)),
    "toiletpaper": ((), (0.1, 0.1, 0.1)),
    "tvstand": (("tv_stand",), (1.2, 0.6, 0.7)),
    "vacuumcleaner": ((), (0.35, 0.3, 1.0)),
    "walldecor": _PICTURE,
    "wardrobe": (("wardrobe",), (1.2, 0.6, 2.0)),
    "washingmachine": (("washing_machine",), (0.7, 0.7, 1.05)),
}


@dataclass(frozen=True)
class AssetDatabase:
    """Types and sizes of ProcTHOR assets, which are guessed from names if there is no database."""

    types: Mapping[str, str]  # object types by asset name
    sizes: Mapping[str, Floats]  # width, depth and height in metres, by asset name
    source: str  # origin of the sizes, for the import report

    @classmethod
    def read(cls, folders: Iterable[Path]) -> "AssetDatabase":
        """Read the first database found in the given folders. Raise `AssetError` if it is not valid."""
        file = next((folder / DATABASE for folder in folders if (folder / DATABASE).is_file()), None)
        if file is None:
            return cls(
                {}, {}, f"typical ones of each type; for exact ones, pass --models DIR with {DATABASE}"
            )
        try:
            every = [(kind, asset) for kind, assets in read_json(read_text(file)).items() for asset in assets]
            types = {asset["assetId"]: kind for kind, asset in every}
            sizes = {
                asset["assetId"]: np.array([asset["boundingBox"][axis] for axis in "xzy"], np.float64)
                for _, asset in every
                if asset.get("boundingBox")
            }
        except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
            raise AssetError(
                brief(f"cannot read {file} as an asset database of ProcTHOR: {error}")
            ) from error
        return cls(types, sizes, f"of {DATABASE}")

    def type_of(self, thing: Thing) -> str:
        """Guess the furniture type of an object from its type, asset or id. Return "" if it is unknown."""
        for text in (self.types.get(thing.asset_id, ""), thing.asset_id, thing.id):
            plain = re.sub(r"[^a-z]", "", text.lower())
            if found := [key for key in _TYPES if key in plain]:
                return max(found, key=len)
        return ""

    def size_of(self, thing: Thing, kind: str) -> Floats | None:
        """Return the width, depth and height of an object in metres, or None if they are unknown.

        Without a database, the typical size of the type is used. If plausible, the height is taken to be
        twice the height of the object's centre above the floor.
        """
        size = self.sizes.get(thing.asset_id)
        if size is None and kind:
            size = np.array(_TYPES[kind][1])
            if 0.5 < 2 * thing.position.y / size[2] < 1.6:
                size[2] = 2 * thing.position.y
        if size is not None and _TYPES.get(kind) is _PICTURE:
            size = np.maximum(size, (0.0, _PICTURE[1][1], 0.0))  # deep enough to stand out from the wall
        return size


def in_our_style(world: str, assets: Iterable[str]) -> str:
    """Return the MJCF of a world, with the default classes of the apartment model."""
    style = (models_root() / STYLE / "defaults.xml").read_text(encoding="utf-8")
    default = style[style.index("<default>") : style.rindex("</mujocoinclude>")]
    return (
        f'<mujoco><compiler angle="radian" texturedir="textures"/>{default}<asset>{"".join(assets)}</asset>'
        f"<worldbody>{world}</worldbody></mujoco>"
    )


class FurnitureLibrary:
    """A collection of mjsim furniture that can replace ProcTHOR objects of the given types."""

    def __init__(self, types: Iterable[str], folder: Path) -> None:
        self.file = folder / "furniture.xml"
        self._pieces: dict[str, list[list[ScenePiece]]] = {}
        look = draw_appearance(draw_palette(0), stream(0, "look"))
        bodies: list[str] = []
        own: dict[str, Asset] = {}
        for kind in sorted({kind for name in types if name for kind in _TYPES[name][0]}):
            for number in range(_DRAWN):
                made = KINDS[kind].make(stream(0, kind, str(number)), look, smaller=number % 3)
                piece = next((one for one, *_ in flattened(made) if one.kind == kind), made)
                bodies.append(f'<body name="{kind}:{number}">{piece.geoms}</body>')
                pictures = [asset for picture in piece.pictures for asset in picture.assets]
                own |= {asset.name: asset for asset in (*look.assets_of(piece.geoms), *pictures)}
        (folder / "textures").mkdir()
        for asset in own.values():
            if asset.image is not None:
                (folder / "textures" / f"{asset.name}.png").write_bytes(asset.image)
        world = "".join(bodies) or '<geom type="box" size="1 1 1"/>'
        text = in_our_style(world, used_materials(world, [], own.values(), models_root()))
        self.file.write_text(text, encoding="utf-8")

    def take(self, pieces: Iterable[ScenePiece]) -> None:
        """Store the surfaces of the furniture, which the caller has read from `file`."""
        bodies: dict[str, list[ScenePiece]] = {}
        for piece in pieces:
            bodies.setdefault(piece.name, []).append(piece)
        for name, found in bodies.items():
            self._pieces.setdefault(name.partition(":")[0], []).append(found)

    def placed(self, thing: Thing, name: str, size: Floats, frame: Floats) -> tuple[list[ScenePiece], str]:
        """Replace an object by similar furniture or by a box. Return the pieces and the furniture type.

        Args:
            thing: The object to replace.
            name: Type of the object, as returned by `AssetDatabase.type_of`.
            size: Width, depth and height of the object in metres, shape (3,).
            frame: Transform (4, 4) from the object's centre to the frame of the house.
        """
        choices: list[tuple[float, str, list[ScenePiece], Floats, Floats]] = []
        for kind in _TYPES[name][0] if name else ():
            for pieces in self._pieces.get(kind, []):
                corners = np.concatenate([p.surface.corners.reshape(-1, 3) for p in pieces if p.solid])
                # Heights start at z = 0, because the legs of a piece may not be solid.
                low, high = corners.min(axis=0) * (1, 1, 0), corners.max(axis=0)
                stretch = float(np.abs(np.log(size / (high - low))).max())
                choices.append((stretch, kind, pieces, low, high))
        best = min(choices, default=None, key=lambda choice: choice[0])
        if best is None or best[0] > _STRETCH:
            box = primitive(trimesh.creation.box(size), _BLACK if name in _SCREENS else _GREY)
            return [ScenePiece(thing.id, box.moved(frame))], ""
        _, kind, pieces, low, high = best
        fit = np.diag([*(size / (high - low)), 1.0])
        fit[:3, 3] = -fit.diagonal()[:3] * (low + high) / 2
        return [ScenePiece(thing.id, p.surface.moved(frame @ fit), p.seen, p.solid) for p in pieces], kind
