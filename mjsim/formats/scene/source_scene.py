"""The scene that all readers return, options and decisions of an import, and helpers for readers."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from mjsim.formats.scene.surface import Floats, Surface
from mjsim.values.errors import AssetError

UNITS = {"m": 1.0, "mm": 0.001, "cm": 0.01, "in": 0.0254}  # in metres; guessed in this order
AXES = ("y", "z")
TEXTURE_SIDE = 512  # longest side of an image, in pixels
MIN_SIDE, MAX_SIDE = 3.0, 60.0  # limits of a house's longest side, in metres
_STEP = 0.1  # width of the rectangles that approximate slanted outlines, in metres


@dataclass(frozen=True)
class ImportOptions:
    """Options of an object import. Values of None are determined automatically."""

    units: str | None = None  # key of `UNITS`
    up: str | None = None  # one of `AXES`
    scale: float = 1.0  # factor on top of the unit
    mass: float | None = None  # kg
    density: float | None = None  # kg/m^3; excludes `mass`


@dataclass(frozen=True)
class ImportDecision:
    """One line of the report."""

    what: str  # subject
    choice: str
    reason: str = ""  # reason for the choice, or how to change it


@dataclass(frozen=True, eq=False)
class ScenePiece:
    """An object or part of a scene, in the frame of the scene: z up, m."""

    name: str  # its name in the source
    surface: Surface
    seen: bool = True  # drawn
    solid: bool = True  # collides
    loose: bool = False  # movable in the source


@dataclass(frozen=True)
class NamedRoom:
    """A room named by the user or the source."""

    key: str
    label: str
    boxes: tuple[tuple[float, float, float, float], ...]  # rectangles: xmin, ymin, xmax, ymax, in metres


@dataclass(frozen=True)
class Bin:
    """A receptacle in its place."""

    key: str
    room: str  # room key
    x: float  # middle of its base, in metres
    y: float
    yaw: float  # rad
    z: float = 0.0
    place: str = "against the wall"  # description shown to participants


@dataclass(frozen=True, eq=False)
class SourceScene:
    """A scene as it was read."""

    pieces: tuple[ScenePiece, ...]
    kind: str  # kind of source, such as `SDF world`
    notes: tuple[ImportDecision, ...] = ()  # the reader's decisions
    rooms: tuple[NamedRoom, ...] = ()  # if the source names them
    bins: tuple[Bin, ...] = ()  # if the source is an exported mjsim house


@dataclass(frozen=True)
class HouseOptions:
    """Options of a house import. Values of None are determined automatically."""

    units: str | None = None  # key of `UNITS`
    up: str | None = None  # one of `AXES`
    scale: float = 1.0  # factor on top of the unit
    floor: float | None = None  # height of the floor in the source, in metres
    rooms: Path | None = None  # TOML file that names rooms
    models: tuple[Path, ...] = ()  # folders with the source's models
    skip_missing: bool = False  # leave out missing files


@dataclass
class MissingFiles:
    """Files that a source names but that are missing: an error, or left out with `skip`."""

    skip: bool
    files: list[str] = field(default_factory=list)

    def notes(self) -> tuple[ImportDecision, ...]:
        """Report of the files that were left out."""
        return (left_out(f"{len(self.files)} missing", ", ".join(self.files[:6])),) if self.files else ()


def left_out(what: str, why: str) -> ImportDecision:
    """A line of the report about something that was left out."""
    return ImportDecision("left out", what, why)


def numbers(values: Any, count: int, path: Path) -> Floats:
    """`count` numbers of a file as an array (count,). Raise `AssetError` if they are not finite numbers."""
    try:
        found = np.array(values, np.float64)
    except (TypeError, ValueError):
        found = np.empty(0)
    if found.shape != (count,) or not np.isfinite(found).all():
        raise AssetError(f"{path} has {str(values)[:60]!r} where {count} numbers should stand; correct it")
    return found


def moved(pieces: list[ScenePiece], transform: Floats) -> list[ScenePiece]:
    """Pieces moved by a homogeneous transform (4, 4)."""
    return [ScenePiece(p.name, p.surface.moved(transform), p.seen, p.solid, p.loose) for p in pieces]


def unit_of(longest: float) -> str | None:
    """The unit in which a house could have this longest side, or None."""
    return next((unit for unit, metres in UNITS.items() if MIN_SIDE <= longest * metres <= MAX_SIDE), None)


def boxes_of(outline: Floats) -> tuple[tuple[float, float, float, float], ...]:
    """Rectangles, m, that cover a polygon (k, 2). Raise `ValueError` if its area is 0.

    Slanted sides are approximated in steps of 0.1 m.
    """
    polygon = shapely.Polygon(outline) if len(outline) > 2 else shapely.Polygon()
    if not polygon.is_valid or polygon.area < _STEP**2:
        raise ValueError("has no floor")
    if np.ptp(outline, axis=0).max() > MAX_SIDE:
        raise ValueError(f"spans more than {MAX_SIDE:g} m")
    sides = np.abs(np.diff(outline, axis=0, append=outline[:1]))
    slanted = sides.min(axis=1).max() > 0.01
    cuts = [
        np.arange(v.min(), v.max() + _STEP, _STEP) if slanted else np.unique(v.round(3)) for v in outline.T
    ]
    middles = np.meshgrid(*((cut[1:] + cut[:-1]) / 2 for cut in cuts), indexing="ij")
    x, y = (cut.tolist() for cut in cuts)
    mask = shapely.contains_xy(polygon, *middles)
    return tuple((x[a], y[c], x[b], y[d]) for a, b, c, d in merged_rectangles(mask))


def merged_rectangles(mask: NDArray[np.bool_]) -> Iterator[tuple[int, int, int, int]]:
    """Rectangles (first row, end row, first column, end column) that cover each cell of a mask (nx, ny) once; ends are
    exclusive.
    """
    left = mask.copy()
    for row in range(len(left)):
        while left[row].any():
            start = int(left[row].argmax())
            stop = start
            while stop < left.shape[1] and left[row, stop]:
                stop += 1
            end = row + 1
            while end < len(left) and left[end, start:stop].all():
                end += 1
            left[row:end, start:stop] = False
            yield row, end, start, stop


def words_of(name: str) -> list[str]:
    """Words of a name: `KitchenCabinet_01_001` gives kitchen, cabinet."""
    return [word.lower() for word in re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", name)]
