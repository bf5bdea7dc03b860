"""Select one storey of a scene with several storeys."""

from collections.abc import Sequence

import numpy as np

from mjsim.formats.scene.source_scene import MAX_SIDE, ImportDecision, ScenePiece, left_out
from mjsim.house.validation.object_rules import SIZE
from mjsim.importing.house.solids import LOW
from mjsim.values.errors import AssetError

_STOREY = 2.1  # minimum distance between two storeys, in metres
_LEVEL = 0.4  # minimum area of a floor, relative to the largest area at any height
# Resolution of heights, and maximum distance between layers of the same floor, in metres.
_BIN, _STEP = 0.02, 0.3
_UPWARD = 0.2  # share of level surfaces that must face up for the others to be ignored
_FLAT = 0.95  # cosine of the maximum slope angle of a floor
FAR = 200.0  # size above which a scene cannot be a house, in metres
_MOST = 0.9  # minimum share of the names that have only nearby pieces, for distant pieces to be removed


def near_pieces(pieces: Sequence[ScenePiece]) -> tuple[list[ScenePiece], list[ImportDecision]]:
    """Remove pieces that are far from most others, such as objects that fell through the floor."""
    middles = np.array([piece.surface.corners.mean(axis=(0, 1)) for piece in pieces])
    near = np.abs(middles - np.median(middles, axis=0)).max(axis=1) < MAX_SIDE
    names = sorted({piece.name for piece, is_near in zip(pieces, near, strict=True) if not is_near})
    if not names or len(names) > (1 - _MOST) * len({piece.name for piece in pieces}):
        return list(pieces), []
    kept = [piece for piece, is_near in zip(pieces, near, strict=True) if is_near]
    return kept, [left_out(", ".join(names[:6]), f"more than {MAX_SIDE:g} m away")]


def floor_and_ceiling(pieces: Sequence[ScenePiece]) -> tuple[float, float]:
    """Return the heights of the lowest floor and of the floor above it (or infinity), in metres."""
    corners = np.concatenate([p.surface.corners for p in pieces])
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    area = np.linalg.norm(normals, axis=1)
    flat = np.abs(normals[:, 2]) > _FLAT * np.maximum(area, 1e-12)
    upward = flat & (normals[:, 2] > 0)
    if area[upward].sum() > _UPWARD * area[flat].sum():
        flat = upward  # Ignore the undersides of slabs.
    heights = corners[flat, :, 2].mean(axis=1)
    if not len(heights):
        raise AssetError("has no level surface; is it a house, and which way is up (--up)?")
    bins = np.round(heights / _BIN).astype(int)
    first = bins.min()
    total = np.bincount(bins - first, area[flat])
    wide = np.convolve(total, np.ones(3))[1:-1]
    levels = np.flatnonzero(wide >= _LEVEL * wide.max())
    # The ground, the slab and the floor are often separate layers.
    near_ground = levels[levels <= levels[0] + round(_STEP / _BIN)]
    lowest = near_ground[np.argmax(total[near_ground])] if np.ptp(near_ground) <= 2 else near_ground[-1]
    if (lowest + first) * _BIN >= corners[:, :, 2].max() - LOW:  # Only wall tops were found, no floor.
        return float(corners[:, :, 2].min()), np.inf
    near = np.abs(bins - first - lowest) <= 1
    order = np.argsort(heights[near])
    share = np.cumsum(area[flat][near][order])
    # The floor height is the median, weighted by area.
    floor = float(heights[near][order][np.searchsorted(share, share[-1] / 2)])
    above = [height for height in (levels + first) * _BIN if height > floor + _STOREY]
    return floor, (min(above) if above else np.inf)


def of_one_storey(pieces: list[ScenePiece], ceiling: float) -> tuple[list[ScenePiece], list[ImportDecision]]:
    """Remove loose objects, and all geometry below the floor or above `ceiling`, in metres."""
    kept, loose = [], []
    dropped = 0
    for piece in pieces:
        corners = piece.surface.corners
        longest = float(np.ptp(corners.reshape(-1, 3), axis=0).max())
        if piece.loose and longest <= SIZE[1]:
            loose.append(piece.name)
            continue
        stays = (corners[:, :, 2].min(axis=1) <= ceiling + 0.05) & (corners[:, :, 2].max(axis=1) > -0.3)
        dropped += int((~stays).sum())
        if stays.any():
            kept.append(ScenePiece(piece.name, piece.surface.select(stays), piece.seen, piece.solid))
    notes = []
    if loose:
        names = sorted(set(loose))
        listed = ", ".join(names[:6]) + (", ..." if len(names) > 6 else "")
        reason = f"{listed}: use mjsim import object for those"
        notes.append(ImportDecision("loose things", f"{len(names)} left out", reason))
    if dropped:
        gone = f"{counted(dropped, 'triangle')} left out"
        notes.append(ImportDecision("other storeys", gone, "one storey is kept"))
    return kept, notes


def counted(number: int, what: str) -> str:
    """Format a number followed by a noun, in the plural if necessary."""
    return f"{number:,} {what}{'' if number == 1 else 's'}"
