"""Close holes in surfaces, and compute the mass of the closed bodies."""

from dataclasses import dataclass

import numpy as np
import trimesh
from trimesh.convex import convex_hull

from mjsim.formats.scene.surface import Floats
from mjsim.house.validation.object_rules import MASS
from mjsim.values.errors import AssetError

MAX_TRIANGLES = 20_000  # maximum number of triangles of a surface; finer surfaces are simplified
MAX_PIECES = 400  # maximum number of pieces of a surface that are closed individually
SHEET = 0.001  # thickness that is given to a flat sheet, in metres
MIN_MASS, MAX_MASS = MASS
DENSITY = 400.0  # default density in kg/m^3, between that of cloth and that of wood
_MIN_GYRATION = 0.005  # minimum radius of gyration of an object, in metres
_GENTLE = 3  # aggressiveness of the mesh simplification, from 1 to 10; the default is 7
_FLAT = 1e-5  # maximum thickness of a set of points that counts as flat, in metres


@dataclass(frozen=True, eq=False)
class ClosedBody:
    """A closed mesh, and the repairs that were needed to close it."""

    mesh: trimesh.Trimesh  # closed surface in metres, with outward normals
    pieces: int  # number of connected pieces of the original surface
    filled: int = 0  # number of pieces whose holes were filled
    hulled: int = 0  # number of pieces replaced by their convex hulls
    flat: bool = False  # True if the surface was a flat sheet and was given a thickness
    open_share: float = 0.0  # share of the surface area in pieces that were replaced by hulls


def close(mesh: trimesh.Trimesh) -> ClosedBody:
    """Close the holes of a surface. All of its triangles must have an area above 0."""
    sheet = _thickened_sheet(mesh.vertices)
    if sheet is not None:
        return ClosedBody(sheet, 1, flat=True)
    count = int(mesh.body_count)
    whole = _as_it_is(mesh)
    if whole is not None:
        return ClosedBody(whole, count)
    if count > MAX_PIECES:
        return ClosedBody(convex_hull(mesh.vertices), count, hulled=count, open_share=1.0)
    return _piecewise(mesh)


def simplified(mesh: trimesh.Trimesh, faces: int) -> trimesh.Trimesh:
    """Simplify a mesh to about `faces` faces by quadric edge collapse (Garland and Heckbert, 1997).

    A mesh with thin wires keeps more faces, because whole pieces would disappear otherwise.
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
    # Nested shells may be cavities or inverted pieces. Accept them only if there is a single outer shell.
    return whole if whole.volume > 0 and (not shells or _is_hollow(shells)) else None


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
        elif np.sort(_spread(piece.vertices)[0])[1] > _FLAT:  # Leave out pieces that are only lines.
            hulled += 1
            area += piece.area
            body = _thickened_sheet(piece.vertices) or convex_hull(piece.vertices)
        closed.append(body)
    share = area / float(sum(piece.area for piece in pieces))
    return ClosedBody(
        _union([b for b in closed if b is not None]), len(pieces), filled, hulled, open_share=share
    )


def _closed_piece(piece: trimesh.Trimesh) -> trimesh.Trimesh | None:
    if _spread(piece.vertices)[0][2] <= _FLAT:  # Filling the hole of a flat piece closes it without a volume.
        return None
    body = piece.copy()
    if not body.is_watertight:
        trimesh.repair.fill_holes(body, use_fan=True)
    if not body.is_watertight:
        return None
    body.fix_normals(multibody=False)
    if body.volume < 0:
        body.invert()
    # A hole that is filled with a fan of triangles may bulge beyond the hull.
    enclosed = body.is_volume and body.volume <= 1.001 * body.convex_hull.volume
    return body if enclosed and body.volume > 0.01 * body.convex_hull.volume else None


def _union(bodies: list[trimesh.Trimesh]) -> trimesh.Trimesh:
    if len(bodies) == 1:
        return bodies[0]
    whole = trimesh.boolean.union(bodies, engine="manifold", check_volume=False)
    return whole if whole.is_volume else trimesh.util.concatenate(bodies)


def _thickened_sheet(points: Floats) -> trimesh.Trimesh | None:
    """Return a thin slab around points (n, 3), or None if the points are not in a plane."""
    spread, axes = _spread(points)
    if spread[2] > _FLAT:
        return None
    normal = axes[2] * SHEET / 2
    return convex_hull(np.concatenate((points - normal, points + normal)))


def _spread(points: Floats) -> tuple[Floats, Floats]:
    """Return the extents (3,) of points (n, 3) along their principal axes, and the axes as rows (3, 3)."""
    offsets = points - points.mean(axis=0)
    _, axes = np.linalg.eigh(offsets.T @ offsets)
    axes = axes.T[::-1]
    return np.ptp(offsets @ axes.T, axis=0), axes


def is_closed(mesh: trimesh.Trimesh) -> bool:
    """Return True if a surface has no holes. Its pieces may touch each other along edges."""
    _, counts = np.unique(mesh.edges_sorted, axis=0, return_counts=True)
    return bool(np.all(counts % 2 == 0))


@dataclass(frozen=True, eq=False)
class Weight:
    """The mass, centre of mass and inertia of an object."""

    mass: float  # mass of the object in kg
    centre: Floats  # centre of mass in metres, shape (3,)
    inertia: Floats  # inertia about the centre of mass in kg m^2, shape (3, 3)
    reason: str  # explanation of how the mass was determined, for the report

    def moved(self, transform: Floats) -> "Weight":
        """Return the mass properties after a rigid transform (4, 4)."""
        turn = transform[:3, :3]
        centre = turn @ self.centre + transform[:3, 3]
        return Weight(self.mass, centre, turn @ self.inertia @ turn.T, self.reason)


def weigh(body: trimesh.Trimesh, *, mass: float | None, density: float | None) -> Weight:
    """Compute the mass properties of a closed body from a mass in kg, a density in kg/m^3, or `DENSITY`.

    Raise an AssetError if the mass is outside the range that a hand can carry.
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
    """Return the inertia (3, 3) about the centre of mass in kg m^2. No principal moment is close to zero."""
    values, axes = np.linalg.eigh(np.asarray(body.moment_inertia) * mass / body.volume)
    values = np.maximum(values, mass * _MIN_GYRATION**2)
    # The largest moment cannot exceed the sum of the others, unless the body intersects itself.
    values[2] = min(values[2], values[0] + values[1])
    return np.asarray(axes @ np.diag(values) @ axes.T)
