"""The storey of a scene that becomes the house: its floor, and what belongs to it."""

from collections.abc import Sequence

import numpy as np

from mjsim.formats.scene.source_scene import ImportDecision, Piece, left_out
from mjsim.house.validation.object_rules import SIZE
from mjsim.importing.house.solids import LOW
from mjsim.values.errors import AssetError

_STOREY = 2.1  # m above a floor, from where on another floor is another storey
_LEVEL = 0.4  # share of the largest level that a floor has at least
_BIN, _STEP = 0.02, 0.3  # m: resolution of heights; what lies on the lowest area within a step is the floor
_UPWARD = 0.2  # share of level surfaces that face up, from where on only these count
_FLAT = 0.95  # cosine of the slope of a floor
FAR = 200.0  # m; what spans more is in no unit of a house
_MOST = 0.9  # share of the pieces that are near each other, from where on the others are left out


def near_pieces(pieces: Sequence[Piece]) -> tuple[list[Piece], list[ImportDecision]]:
    """Pieces without the few that lie far off, such as what fell through the floor of a simulation."""
    middles = np.array([piece.surface.corners.mean(axis=(0, 1)) for piece in pieces])
    near = np.abs(middles - np.median(middles, axis=0)).max(axis=1) < FAR
    if near.all() or near.mean() < _MOST:
        return list(pieces), []
    names = sorted({piece.name for piece, is_near in zip(pieces, near, strict=True) if not is_near})
    kept = [piece for piece, is_near in zip(pieces, near, strict=True) if is_near]
    return kept, [left_out(", ".join(names[:6]), f"more than {FAR:g} m away")]


def floor_and_ceiling(pieces: Sequence[Piece]) -> tuple[float, float]:
    """Height of the floor, and of the floor of the storey above it, m; infinite where there is none."""
    corners = np.concatenate([p.surface.corners for p in pieces])
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    area = np.linalg.norm(normals, axis=1)
    flat = np.abs(normals[:, 2]) > _FLAT * np.maximum(area, 1e-12)
    upward = flat & (normals[:, 2] > 0)
    if area[upward].sum() > _UPWARD * area[flat].sum():
        flat = upward  # of a slab, what one stands on
    heights = corners[flat, :, 2].mean(axis=1)
    if not len(heights):
        raise AssetError("has no level surface; is it a house, and which way is up (--up)?")
    bins = np.round(heights / _BIN).astype(int)
    first = bins.min()
    total = np.bincount(bins - first, area[flat])
    wide = np.convolve(total, np.ones(3))[1:-1]
    levels = np.flatnonzero(wide >= _LEVEL * wide.max())
    near_ground = levels[levels <= levels[0] + round(_STEP / _BIN)]  # ground, slab and floor are often layers
    lowest = near_ground[np.argmax(total[near_ground])] if np.ptp(near_ground) <= 2 else near_ground[-1]
    if (lowest + first) * _BIN >= corners[:, :, 2].max() - LOW:  # walls without a floor: these are their tops
        return float(corners[:, :, 2].min()), np.inf
    near = np.abs(bins - first - lowest) <= 1
    order = np.argsort(heights[near])
    share = np.cumsum(area[flat][near][order])
    floor = float(heights[near][order][np.searchsorted(share, share[-1] / 2)])  # the median of the area
    above = [height for height in (levels + first) * _BIN if height > floor + _STOREY]
    return floor, (min(above) if above else np.inf)


def of_one_storey(pieces: list[Piece], ceiling: float) -> tuple[list[Piece], list[ImportDecision]]:
    """Pieces without what a hand carries, and without what is above a height, m, or below the floor."""
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
            kept.append(Piece(piece.name, piece.surface.select(stays), piece.seen, piece.solid))
    notes = []
    if loose:
        names = sorted(set(loose))
        notes.append(
            ImportDecision(
                "loose things",
                f"{len(names)} left out",
                f"{', '.join(names[:6])}{', ...' if len(names) > 6 else ''}: use mjsim import object for those",
            )
        )
    if dropped:
        notes.append(
            ImportDecision("other storeys", f"{counted(dropped, 'triangle')} left out", "one storey is kept")
        )
    return kept, notes


def counted(number: int, what: str) -> str:
    """A number and what it counts, with an `s` for several."""
    return f"{number:,} {what}{'' if number == 1 else 's'}"
