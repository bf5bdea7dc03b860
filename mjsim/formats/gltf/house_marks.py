"""Marks in the extras of an exported glTF file, from which the rooms and bins of the house can be imported again."""

from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np

from mjsim.formats.scene.mesh_files import gltf_header
from mjsim.formats.scene.source_scene import Bin, NamedRoom, boxes_of
from mjsim.values.errors import AssetError, brief

MARKS = "mjsim_house"  # key in the extras of the root node


class MarkedRoom(msgspec.Struct):
    """A rectangle of a room. A room may have several rectangles."""

    key: Annotated[str, msgspec.Meta(pattern="^[a-z][a-z0-9_]*$")]
    label: str
    polygon: list[tuple[float, float]]  # corners in the frame of the house, in metres


class MarkedBin(msgspec.Struct):
    """A bin and the pose of its base in the frame of the house."""

    key: str
    room: str
    place: str
    position: tuple[float, float, float]  # in metres
    yaw: float  # in radians


class HouseMarks(msgspec.Struct):
    """The rooms and bins of an exported house."""

    parts: list[MarkedRoom] = []
    bins: list[MarkedBin] = []

    def rooms(self) -> tuple[NamedRoom, ...]:
        found: dict[str, NamedRoom] = {}
        for part in self.parts:
            boxes = boxes_of(np.array(part.polygon))
            known = found.get(part.key, NamedRoom(part.key, part.label, ()))
            found[part.key] = NamedRoom(part.key, part.label, (*known.boxes, *boxes))
        return tuple(found.values())

    def places(self) -> tuple[Bin, ...]:
        return tuple(Bin(b.key, b.room, *b.position[:2], b.yaw, b.position[2], b.place) for b in self.bins)


class _Node(msgspec.Struct):
    extras: Any = None


class _Header(msgspec.Struct):
    nodes: list[_Node] = []


def read_marks(path: Path) -> HouseMarks:
    """Read the marks of a GLB or glTF file. Other files have none. Raise an AssetError if they are damaged."""
    try:
        extras = [node.extras for node in msgspec.json.decode(gltf_header(path), type=_Header).nodes]
        found: Any = next((e[MARKS] for e in extras if isinstance(e, dict) and MARKS in e), {})
        marks = msgspec.convert(found, HouseMarks)
        marks.rooms()
    except ValueError as error:
        raise AssetError(brief(f"{path} has damaged {MARKS} extras: {error}; export it again")) from error
    return marks
