"""Types for scenes, options and decisions of an import, with helper functions for readers."""

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

# Length of each unit in metres; units are guessed in this order.
UNITS = {"m": 1.0, "mm": 0.001, "cm": 0.01, "in": 0.0254}
AXES = ("y", "z")
TEXTURE_SIDE = 512  # maximum side of an image, in pixels
MIN_SIDE, MAX_SIDE = 3.0, 60.0  # minimum and maximum of a house's longest side, in metres
_STEP = 0.1  # width of the rectangles that approximate slanted outlines, in metres


@dataclass(frozen=True)
class ImportOptions:
    """Options of an object import. Values of None are determined automatically."""

    units: str | None = None  # unit of length, a key of `UNITS`
    up: str | None = None  # vertical axis, one of `AXES`
    scale: float = 1.0  # factor applied in addition to the unit
    mass: float | None = None  # mass in kg
    density: float | None = None  # density in kg/m^3; must be None if `mass` is given


@dataclass(frozen=True)
class ImportDecision:
    """A line of the import report."""

    what: str  # subject of the decision
    choice: str
    reason: str = ""  # reason for the decision, or how to change it


@dataclass(frozen=True, eq=False)
class ScenePiece:
    """An object or part of a scene, in the frame of the scene: z up, in metres."""

    name: str  # name of the piece in the source
    surface: Surface
    seen: bool = True  # True if the piece is drawn
    solid: bool = True  # True if the piece collides
    loose: bool = False  # True if the piece is movable in the source


@dataclass(frozen=True)
class NamedRoom:
    """A room named by the user or the source."""

    key: str
    label: str
    boxes: tuple[tuple[float, float, float, float], ...]  # rectangles (xmin, ymin, xmax, ymax) in metres


@dataclass(frozen=True)
class Bin:
    """A receptacle placed in a house."""

    key: str
    room: str
    x: float  # x coordinate of the middle of the base, in metres
    y: float
    yaw: float  # yaw in radians
    z: float = 0.0
    place: str = "against the wall"  # description of the location, shown to participants


@dataclass(frozen=True, eq=False)
class SourceScene:
    """A scene as returned by a reader."""

    pieces: tuple[ScenePiece, ...]
    kind: str  # type of the source, such as `SDF world`
    notes: tuple[ImportDecision, ...] = ()  # decisions of the reader
    rooms: tuple[NamedRoom, ...] = ()  # rooms named by the source
    bins: tuple[Bin, ...] = ()  # bins of a source that is an exported mjsim house


@dataclass(frozen=True)
class HouseOptions:
    """Options of a house import. Values of None are determined automatically."""

    units: str | None = None  # unit of length, a key of `UNITS`
    up: str | None = None  # vertical axis, one of `AXES`
    scale: float = 1.0  # factor applied in addition to the unit
    floor: float | None = None  # height of the floor in the source, in metres
    rooms: Path | None = None  # TOML file that names the rooms
    models: tuple[Path, ...] = ()  # folders with models that the source refers to
    skip_missing: bool = False  # True to leave out missing files instead of raising an error


@dataclass
class MissingFiles:
    """Missing files that a source refers to. They are an error, unless `skip` is True."""

    skip: bool
    files: list[str] = field(default_factory=list)

    def notes(self) -> tuple[ImportDecision, ...]:
        """Return report lines about the files that were left out."""
        return (left_out(f"{len(self.files)} missing", ", ".join(self.files[:6])),) if self.files else ()


def left_out(what: str, why: str) -> ImportDecision:
    """Return a report line about something that was left out."""
    return ImportDecision("left out", what, why)


def numbers(values: Any, count: int, path: Path) -> Floats:
    """Convert `count` numbers of a file to an array (count,). Raise `AssetError` if they are not finite numbers."""
    try:
        found = np.array(values, np.float64)
    except (TypeError, ValueError):
        found = np.empty(0)
    if found.shape != (count,) or not np.isfinite(found).all():
        raise AssetError(f"{path} has {str(values)[:60]!r} where {count} numbers should stand; correct it")
    return found


def moved(pieces: list[ScenePiece], transform: Floats) -> list[ScenePiece]:
    """Return pieces moved by a homogeneous transform (4, 4)."""
    return [ScenePiece(p.name, p.surface.moved(transform), p.seen, p.solid, p.loose) for p in pieces]


def unit_of(longest: float) -> str | None:
    """Return the unit in which a house could have this longest side, or None if there is none."""
    return next((unit for unit, metres in UNITS.items() if MIN_SIDE <= longest * metres <= MAX_SIDE), None)


def boxes_of(outline: Floats) -> tuple[tuple[float, float, float, float], ...]:
    """Return rectangles in metres that cover a polygon (k, 2). Raise `ValueError` if its area is 0.

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
    """Yield rectangles (first row, end row, first column, end column) that cover each cell of a mask (nx, ny) once.
    Ends are exclusive.
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
    """Split a name into words. For example, `KitchenCabinet_01_001` gives kitchen and cabinet."""
    return [word.lower() for word in re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", name)]
