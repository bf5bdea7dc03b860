"""The body that a surface encloses: closed as it is, with holes filled, or the convex hull of what stays open."""

from dataclasses import dataclass

import numpy as np
import trimesh

from mjsim.formats.scene.surface import Floats

MAX_TRIANGLES = 20_000  # of what is worked on; finer surfaces are simplified first
MAX_PIECES = 400  # pieces of a surface that are closed one by one
SHEET = 0.001  # m, thickness that a flat sheet is given
_GENTLE = 3  # of 1 to 10, how hard faces are collapsed; 7 is usual
_FLAT = 1e-5  # m


@dataclass(frozen=True, eq=False)
class Solid:
    """A closed body."""

    mesh: trimesh.Trimesh  # its surface, m, normals outward; it encloses a positive volume
    pieces: int  # how many connected pieces the surface had
    filled: int = 0  # how many of them had holes that were filled
    hulled: int = 0  # how many were replaced by their convex hull
    flat: bool = False  # whether it is a sheet that was given a thickness
    open_share: float = 0.0  # share of the surface's area that belongs to pieces replaced by hulls


def close(mesh: trimesh.Trimesh) -> Solid:
    """The body that a surface encloses; its triangles have areas."""
    sheet = _thickened_sheet(mesh.vertices)
    if sheet is not None:
        return Solid(sheet, 1, flat=True)
    count = int(mesh.body_count)
    whole = _as_it_is(mesh)
    if whole is not None:
        return Solid(whole, count)
    if count > MAX_PIECES:
        return Solid(_hull(mesh.vertices), count, hulled=count, open_share=1.0)
    return _piecewise(mesh)


def simplified(mesh: trimesh.Trimesh, faces: int) -> trimesh.Trimesh:
    """The mesh with about this many faces, if it has more; by quadric edge collapse (Garland and Heckbert 1997).

    Thin wires are not collapsed, and to make up for it whole pieces would be: then it keeps more faces.
    """
    if len(mesh.faces) <= faces:
        return mesh
    coarse = mesh.simplify_quadric_decimation(face_count=faces)
    if len(mesh.faces) > MAX_TRIANGLES or coarse.body_count == mesh.body_count:
        return coarse
    gentle = mesh.simplify_quadric_decimation(face_count=faces, aggression=_GENTLE)
    return gentle if gentle.body_count == mesh.body_count else mesh


def _as_it_is(mesh: trimesh.Trimesh) -> trimesh.Trimesh | None:
    """The mesh itself if it is closed, turned inside out if need be; else None."""
    if not (mesh.is_watertight and mesh.is_winding_consistent):
        return None
    whole = mesh.copy()
    if whole.volume < 0:
        whole.invert()
    shells = whole.split(only_watertight=False, repair=False) if whole.body_count > 1 else []
    overlapping = sum(shell.volume > 0 for shell in shells) > 1 or any(s.volume < 0 for s in shells)
    # Shells inside of each other may be cavities or pieces turned inside out: only one body is taken as it is.
    return None if overlapping and not _is_hollow(shells) else whole if whole.volume > 0 else None


def _is_hollow(shells: list[trimesh.Trimesh]) -> bool:
    """Whether all shells but one are cavities inside of that one."""
    outer = [s for s in shells if s.volume > 0]
    cavities = [s for s in shells if s.volume < 0]
    if len(outer) != 1:
        return False
    low, high = outer[0].bounds
    return all(np.all(c.bounds[0] > low) and np.all(c.bounds[1] < high) for c in cavities)


def _piecewise(mesh: trimesh.Trimesh) -> Solid:
    pieces = mesh.split(only_watertight=False, repair=False)
    closed, filled, hulled, area = [], 0, 0, 0.0
    for piece in pieces:
        body = _closed_piece(piece)
        if body is not None:
            filled += not piece.is_watertight
        elif np.sort(_spread(piece.vertices)[0])[1] > _FLAT:  # else it is a line
            hulled += 1
            area += piece.area
            body = _thickened_sheet(piece.vertices) or _hull(piece.vertices)
        closed.append(body)
    share = area / float(sum(piece.area for piece in pieces))
    return Solid(_union([b for b in closed if b is not None]), len(pieces), filled, hulled, open_share=share)


def _closed_piece(piece: trimesh.Trimesh) -> trimesh.Trimesh | None:
    """A connected piece with consistent normals and its holes filled, or None if it stays open."""
    body = piece.copy()
    if not body.is_watertight:
        trimesh.repair.fill_holes(body, use_fan=True)
    if not body.is_watertight:
        return None
    body.fix_normals(multibody=False)
    if body.volume < 0:
        body.invert()
    # Fans over holes that are not convex may stick out.
    enclosed = body.is_volume and body.volume <= 1.001 * body.convex_hull.volume
    return body if enclosed and body.volume > 0.01 * body.convex_hull.volume else None


def _union(bodies: list[trimesh.Trimesh]) -> trimesh.Trimesh:
    """Closed bodies as one, what overlaps counted once."""
    if len(bodies) == 1:
        return bodies[0]
    whole = trimesh.boolean.union(bodies, engine="manifold", check_volume=False)
    return whole if whole.is_volume else trimesh.util.concatenate(bodies)


def _hull(points: Floats) -> trimesh.Trimesh:
    return trimesh.convex.convex_hull(points)


def _thickened_sheet(points: Floats) -> trimesh.Trimesh | None:
    """A slab around points (n, 3), m, that lie in one plane; None if they do not."""
    spread, axes = _spread(points)
    if spread[2] > _FLAT:
        return None
    normal = axes[2] * SHEET / 2
    return _hull(np.concatenate((points - normal, points + normal)))


def _spread(points: Floats) -> tuple[Floats, Floats]:
    """Extents (3,) of points (n, 3), m, along their principal axes (3, 3), the rows, widest first."""
    offsets = points - points.mean(axis=0)
    _, axes = np.linalg.eigh(offsets.T @ offsets)
    axes = axes.T[::-1]
    return np.ptp(offsets @ axes.T, axis=0), axes


def is_closed(mesh: trimesh.Trimesh) -> bool:
    """Whether no edge of a mesh is the rim of a hole; pieces may touch each other along edges."""
    _, counts = np.unique(mesh.edges_sorted, axis=0, return_counts=True)
    return bool(np.all(counts % 2 == 0))
