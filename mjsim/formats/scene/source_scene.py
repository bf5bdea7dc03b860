"""The scene that every reader returns, options and decisions of an import, and helpers that readers share."""

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

UNITS = {"m": 1.0, "mm": 0.001, "cm": 0.01, "in": 0.0254}  # metres; in the order of guessing
AXES = ("y", "z")
TEXTURE_SIDE = 512  # px, longest side of a picture
MIN_SIDE, MAX_SIDE = 3.0, 60.0  # m, longest sides that houses have
_STEP = 0.1  # m, of the rectangles that cover slanted outlines


@dataclass(frozen=True)
class ImportOptions:
    """What the user gives; None for what is to be found out."""

    units: str | None = None  # key of `UNITS`
    up: str | None = None  # one of `AXES`
    scale: float = 1.0  # factor on top of the unit
    mass: float | None = None  # kg
    density: float | None = None  # kg/m^3; not with `mass`


@dataclass(frozen=True)
class ImportDecision:
    """One line of the report."""

    what: str  # what was decided
    choice: str  # how
    reason: str = ""  # why, or what to do if it is not what was meant


@dataclass(frozen=True, eq=False)
class Piece:
    """A thing of a scene in the frame of the scene: z up, m."""

    name: str  # as the source calls it
    surface: Surface
    seen: bool = True  # whether it is drawn
    solid: bool = True  # whether one bumps into it
    loose: bool = False  # whether the source lets it move


@dataclass(frozen=True)
class NamedRoom:
    """A room that the user or the source gives."""

    key: str
    label: str
    boxes: tuple[tuple[float, float, float, float], ...]  # xmin, ymin, xmax, ymax of rectangles, m


@dataclass(frozen=True)
class Bin:
    """A receptacle in its place."""

    key: str
    room: str  # room key
    x: float  # m, middle of its base
    y: float
    yaw: float  # rad
    z: float = 0.0
    place: str = "against the wall"  # as people read it


@dataclass(frozen=True, eq=False)
class SourceScene:
    """A scene as it was read."""

    pieces: tuple[Piece, ...]
    kind: str  # of the source, such as `SDF world`
    notes: tuple[ImportDecision, ...] = ()  # what was decided on the way
    rooms: tuple[NamedRoom, ...] = ()  # where the source names them
    bins: tuple[Bin, ...] = ()  # where the source was a house of ours


@dataclass(frozen=True)
class HouseOptions:
    """What the user gives; None for what is to be found out."""

    units: str | None = None  # key of `mjsim.formats.scene.source_scene.UNITS`
    up: str | None = None  # `y` or `z`
    scale: float = 1.0  # factor on top of the unit
    floor: float | None = None  # height of the floor in the source, m
    rooms: Path | None = None  # TOML file that names rooms
    models: tuple[Path, ...] = ()  # folders in which the source's models lie
    skip_missing: bool = False  # whether files that are not there are left out


@dataclass
class Missing:
    """Files that a source names and that are not there: refused, or left out if the user says so."""

    skip: bool
    files: list[str] = field(default_factory=list)

    def notes(self) -> tuple[ImportDecision, ...]:
        """What was left out, for the report."""
        return (left_out(f"{len(self.files)} missing", ", ".join(self.files[:6])),) if self.files else ()


def left_out(what: str, why: str) -> ImportDecision:
    """A line of the report about something that the house lacks."""
    return ImportDecision("left out", what, why)


def numbers(values: Any, count: int, path: Path) -> Floats:
    """So many numbers of a file, (count,); `AssetError` where they are none or not finite."""
    try:
        found = np.array(values, np.float64)
    except (TypeError, ValueError):
        found = np.empty(0)
    if found.shape != (count,) or not np.isfinite(found).all():
        raise AssetError(f"{path} has {str(values)[:60]!r} where {count} numbers should stand; correct it")
    return found


def moved(pieces: list[Piece], transform: Floats) -> list[Piece]:
    """Pieces moved by a homogeneous transform (4, 4)."""
    return [Piece(p.name, p.surface.moved(transform), p.seen, p.solid, p.loose) for p in pieces]


def unit_of(longest: float) -> str | None:
    """The unit in which a house could have this longest side, or None."""
    return next((unit for unit, metres in UNITS.items() if MIN_SIDE <= longest * metres <= MAX_SIDE), None)


def boxes_of(outline: Floats) -> tuple[tuple[float, float, float, float], ...]:
    """Rectangles, m, that cover a polygon (k, 2); one with slanted sides in steps of 0.1 m. `ValueError` for none."""
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
    """Rectangles that cover the cells of a mask (nx, ny) once: rows from, to, columns from, to, ends not included."""
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
    """Words of a name such as `KitchenCabinet_01_001`: kitchen, cabinet."""
    return [word.lower() for word in re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", name)]
