"""Types for imported scenes, import options and report lines, with helper functions for readers."""

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

# Length of each unit in metres. Units are tried in this order if the unit has to be guessed.
UNITS = {"m": 1.0, "mm": 0.001, "cm": 0.01, "in": 0.0254}
AXES = ("y", "z")
TEXTURE_SIDE = 512  # maximum side length of imported textures, in pixels
MIN_SIDE, MAX_SIDE = 3.0, 60.0  # limits for the longest side of a house, in metres
_STEP = 0.1  # width of the strips that approximate slanted outlines, in metres


@dataclass(frozen=True)
class ImportOptions:
    """Options for importing an object. Options that are None are determined automatically."""

    units: str | None = None  # unit of length, a key of `UNITS`
    up: str | None = None  # vertical axis, one of `AXES`
    scale: float = 1.0  # factor applied in addition to the unit
    mass: float | None = None  # mass in kg
    density: float | None = None  # density in kg/m^3, which cannot be combined with `mass`


@dataclass(frozen=True)
class ImportDecision:
    """A line of the import report."""

    what: str  # subject of the decision
    choice: str
    reason: str = ""  # reason for the decision, or a hint on how to change it


@dataclass(frozen=True, eq=False)
class ScenePiece:
    """A piece of an imported scene, with coordinates in metres and z up."""

    name: str  # name of the piece in the source
    surface: Surface
    seen: bool = True  # True if the piece is visible
    solid: bool = True  # True if the piece takes part in collisions
    loose: bool = False  # True if the piece can move in the source


@dataclass(frozen=True)
class NamedRoom:
    """A room with a name from the user or the source file."""

    key: str
    label: str
    boxes: tuple[tuple[float, float, float, float], ...]  # rectangles (xmin, ymin, xmax, ymax) in metres


@dataclass(frozen=True)
class Bin:
    """A receptacle placed in a house."""

    key: str
    room: str
    x: float  # x coordinate of the centre of the base, in metres
    y: float
    yaw: float  # yaw angle in radians
    z: float = 0.0
    place: str = "against the wall"  # description of the location that participants see


@dataclass(frozen=True, eq=False)
class SourceScene:
    """An imported scene, as returned by a reader."""

    pieces: tuple[ScenePiece, ...]
    kind: str  # type of the source, such as `SDF world`
    notes: tuple[ImportDecision, ...] = ()  # report lines about decisions of the reader
    rooms: tuple[NamedRoom, ...] = ()  # rooms with names from the source file
    bins: tuple[Bin, ...] = ()  # bins, if the source is an exported mjsim house


@dataclass(frozen=True)
class HouseOptions:
    """Options for importing a house. Options that are None are determined automatically."""

    units: str | None = None  # unit of length, a key of `UNITS`
    up: str | None = None  # vertical axis, one of `AXES`
    scale: float = 1.0  # factor applied in addition to the unit
    floor: float | None = None  # height of the floor in the source scene, in metres
    rooms: Path | None = None  # TOML file with room names
    models: tuple[Path, ...] = ()  # folders that contain the models to which the source refers
    skip_missing: bool = False  # True to skip missing files instead of raising an error


@dataclass
class MissingFiles:
    """The missing files to which a source refers. They cause an error unless `skip` is True."""

    skip: bool
    files: list[str] = field(default_factory=list)

    def notes(self) -> tuple[ImportDecision, ...]:
        """Return the lines of the import report about skipped files."""
        return (left_out(f"{len(self.files)} missing", ", ".join(self.files[:6])),) if self.files else ()


def left_out(what: str, why: str) -> ImportDecision:
    """Return a line of the import report about parts that were not imported."""
    return ImportDecision("left out", what, why)


def numbers(values: Any, count: int, path: Path) -> Floats:
    """Convert values to an array of shape (count,). Raise `AssetError` if they are not finite numbers."""
    try:
        found = np.array(values, np.float64)
    except (TypeError, ValueError):
        found = np.empty(0)
    if found.shape != (count,) or not np.isfinite(found).all():
        raise AssetError(f"{path} has {str(values)[:60]!r} where {count} numbers should stand; correct it")
    return found


def moved(pieces: list[ScenePiece], transform: Floats) -> list[ScenePiece]:
    """Apply a homogeneous transform (4, 4) to pieces."""
    return [ScenePiece(p.name, p.surface.moved(transform), p.seen, p.solid, p.loose) for p in pieces]


def unit_of(longest: float) -> str | None:
    """Guess the unit of a house from the length of its longest side. Return None if no unit is plausible."""
    return next((unit for unit, metres in UNITS.items() if MIN_SIDE <= longest * metres <= MAX_SIDE), None)


def boxes_of(outline: Floats) -> tuple[tuple[float, float, float, float], ...]:
    """Return rectangles in metres that cover a polygon (k, 2). Raise `ValueError` if the polygon is invalid.

    Slanted sides are approximated by strips that are 0.1 m wide.
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
    """Yield disjoint rectangles that cover the True cells of a mask of shape (nx, ny).

    Each rectangle is (first row, end row, first column, end column), with exclusive ends.
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
    """Split a name into lower-case words. `KitchenCabinet_01_001` gives `["kitchen", "cabinet"]`."""
    return [word.lower() for word in re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", name)]
