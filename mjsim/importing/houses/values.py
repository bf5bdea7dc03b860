"""What readers make of a scene, and what the user says about it."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from mjsim.importing.surface import Floats, Surface
from mjsim.importing.values import ImportDecision
from mjsim.values.errors import AssetError

TEXTURE_SIDE = 512  # px, longest side of a picture


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

    units: str | None = None  # key of `mjsim.importing.values.UNITS`
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
