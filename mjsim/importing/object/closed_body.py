"""Closed bodies made from surfaces, and their mass. Holes are filled. Pieces that stay open become convex hulls."""

from dataclasses import dataclass

import numpy as np
import trimesh

from mjsim.formats.scene.surface import Floats
from mjsim.house.validation.object_rules import MASS
from mjsim.values.errors import AssetError

MAX_TRIANGLES = 20_000  # maximum number of triangles of a surface; finer surfaces are simplified first
MAX_PIECES = 400  # maximum number of pieces of a surface that are closed one by one
SHEET = 0.001  # thickness given to a flat sheet, in metres
MIN_MASS, MAX_MASS = MASS
DENSITY = 400.0  # kg/m^3; lower than wood, higher than cloth and hollow plastic
_MIN_GYRATION = 0.005  # minimum radius of gyration in metres, that of a body as wide as the thinnest part
_GENTLE = 3  # how aggressively edges are collapsed, from 1 to 10; the default is 7
_FLAT = 1e-5  # width in metres up to which points count as lying in a plane


@dataclass(frozen=True, eq=False)
class ClosedBody:
    """A closed body, with the repairs that were needed to close it."""

    mesh: trimesh.Trimesh  # surface in metres with outward normals; the enclosed volume is positive
    pieces: int  # number of connected pieces of the surface
    filled: int = 0  # number of pieces whose holes were filled
    hulled: int = 0  # number of pieces replaced by their convex hulls
    flat: bool = False  # True for a flat sheet that was given a thickness
    open_share: float = 0.0  # share of the surface's area that belongs to pieces replaced by hulls


def close(mesh: trimesh.Trimesh) -> ClosedBody:
    """Close a surface. All of its triangles must have an area above 0."""
    sheet = _thickened_sheet(mesh.vertices)
    if sheet is not None:
        return ClosedBody(sheet, 1, flat=True)
    count = int(mesh.body_count)
    whole = _as_it_is(mesh)
    if whole is not None:
        return ClosedBody(whole, count)
    if count > MAX_PIECES:
        return ClosedBody(_hull(mesh.vertices), count, hulled=count, open_share=1.0)
    return _piecewise(mesh)


def simplified(mesh: trimesh.Trimesh, faces: int) -> trimesh.Trimesh:
    """Simplify a mesh to at most about `faces` faces by quadric edge collapse (Garland and Heckbert 1997).

    Thin wires cannot be collapsed, and whole pieces would disappear instead. Such a mesh keeps more faces.
    """
    if len(mesh.faces) <= faces:
        return mesh
    coarse = mesh.simplify_quadric_decimation(face_count=faces)
    if len(mesh.faces) > MAX_TRIANGLES or coarse.body_count == mesh.body_count:
        return coarse
    gentle = mesh.simplify_quadric_decimation(face_count=faces, aggression=_GENTLE)
    return gentle if gentle.body_count == mesh.body_count else mesh


def _as_it_is(mesh: trimesh.Trimesh) -> trimesh.Trimesh | None:
    if not (mesh.is_watertight and mesh.is_winding_consistent):
        return None
    whole = mesh.copy()
    if whole.volume < 0:
        whole.invert()
    shells = whole.split(only_watertight=False, repair=False) if whole.body_count > 1 else []
    overlapping = sum(shell.volume > 0 for shell in shells) > 1 or any(s.volume < 0 for s in shells)
    # Nested shells may be cavities or pieces turned inside out, so only a single body is accepted.
    return None if overlapping and not _is_hollow(shells) else whole if whole.volume > 0 else None


def _is_hollow(shells: list[trimesh.Trimesh]) -> bool:
    outer = [s for s in shells if s.volume > 0]
    cavities = [s for s in shells if s.volume < 0]
    if len(outer) != 1:
        return False
    low, high = outer[0].bounds
    return all(np.all(c.bounds[0] > low) and np.all(c.bounds[1] < high) for c in cavities)


def _piecewise(mesh: trimesh.Trimesh) -> ClosedBody:
    pieces = mesh.split(only_watertight=False, repair=False)
    closed, filled, hulled, area = [], 0, 0, 0.0
    for piece in pieces:
        body = _closed_piece(piece)
        if body is not None:
            filled += not piece.is_watertight
        elif np.sort(_spread(piece.vertices)[0])[1] > _FLAT:  # otherwise the piece is a line
            hulled += 1
            area += piece.area
            body = _thickened_sheet(piece.vertices) or _hull(piece.vertices)
        closed.append(body)
    share = area / float(sum(piece.area for piece in pieces))
    return ClosedBody(
        _union([b for b in closed if b is not None]), len(pieces), filled, hulled, open_share=share
    )


def _closed_piece(piece: trimesh.Trimesh) -> trimesh.Trimesh | None:
    body = piece.copy()
    if not body.is_watertight:
        trimesh.repair.fill_holes(body, use_fan=True)
    if not body.is_watertight:
        return None
    body.fix_normals(multibody=False)
    if body.volume < 0:
        body.invert()
    # A hole filled with a fan of triangles may bulge beyond the hull.
    enclosed = body.is_volume and body.volume <= 1.001 * body.convex_hull.volume
    return body if enclosed and body.volume > 0.01 * body.convex_hull.volume else None


def _union(bodies: list[trimesh.Trimesh]) -> trimesh.Trimesh:
    if len(bodies) == 1:
        return bodies[0]
    whole = trimesh.boolean.union(bodies, engine="manifold", check_volume=False)
    return whole if whole.is_volume else trimesh.util.concatenate(bodies)


def _hull(points: Floats) -> trimesh.Trimesh:
    return trimesh.convex.convex_hull(points)


def _thickened_sheet(points: Floats) -> trimesh.Trimesh | None:
    """Return a slab around points (n, 3) in one plane, or None if they are not in a plane."""
    spread, axes = _spread(points)
    if spread[2] > _FLAT:
        return None
    normal = axes[2] * SHEET / 2
    return _hull(np.concatenate((points - normal, points + normal)))


def _spread(points: Floats) -> tuple[Floats, Floats]:
    """Return the extents (3,) of points (n, 3) along their principal axes, and these axes (3, 3), longest first."""
    offsets = points - points.mean(axis=0)
    _, axes = np.linalg.eigh(offsets.T @ offsets)
    axes = axes.T[::-1]
    return np.ptp(offsets @ axes.T, axis=0), axes


def is_closed(mesh: trimesh.Trimesh) -> bool:
    """Return True if no edge is the rim of a hole. Pieces may touch each other along edges."""
    _, counts = np.unique(mesh.edges_sorted, axis=0, return_counts=True)
    return bool(np.all(counts % 2 == 0))


@dataclass(frozen=True, eq=False)
class Weight:
    """Mass properties of an object."""

    mass: float  # mass in kg
    centre: Floats  # centre of mass in metres, shape (3,)
    inertia: Floats  # inertia about the centre of mass in kg m^2, shape (3, 3)
    reason: str  # explanation of how the mass was determined, for the report

    def moved(self, transform: Floats) -> "Weight":
        """Return the mass properties after a rigid transform (4, 4)."""
        turn = transform[:3, :3]
        centre = turn @ self.centre + transform[:3, 3]
        return Weight(self.mass, centre, turn @ self.inertia @ turn.T, self.reason)


def weigh(body: trimesh.Trimesh, *, mass: float | None, density: float | None) -> Weight:
    """Compute the mass properties of a closed body in metres from its mass (kg), its density (kg/m^3), or `DENSITY`.

    Raise `AssetError` if a hand cannot carry the mass.
    """
    volume = float(body.volume)
    litres = f"{1e3 * volume:.3g} litres"
    total = mass if mass is not None else volume * (density or DENSITY)
    reason = "given" if mass is not None else f"{density or DENSITY:g} kg/m3 in {litres}"
    if mass is None and density is None:
        reason = f"assumed {reason}; set it by --mass or --density"
        if not MIN_MASS <= total <= MAX_MASS:
            reason = f"the {'least' if total < MIN_MASS else 'most'} that is allowed; {reason}"
            total = min(max(total, MIN_MASS), MAX_MASS)
    if not MIN_MASS <= total <= MAX_MASS:
        remedy = f"use --mass with a mass in between (it has {litres})"
        raise AssetError(
            f"it would weigh {total:.3g} kg ({reason}): a hand carries {MIN_MASS} to {MAX_MASS} kg; {remedy}"
        )
    centre = np.asarray(body.center_mass)
    return Weight(total, centre, _inertia(body, total), reason)


def _inertia(body: trimesh.Trimesh, mass: float) -> Floats:
    """Return the inertia (3, 3) about the centre of mass in kg m^2, at least that of a thin rod about its axis."""
    values, axes = np.linalg.eigh(np.asarray(body.moment_inertia) * mass / body.volume)
    values = np.maximum(values, mass * _MIN_GYRATION**2)
    # Physical limit, which a self-intersecting body may violate.
    values[2] = min(values[2], values[0] + values[1])
    return np.asarray(axes @ np.diag(values) @ axes.T)
