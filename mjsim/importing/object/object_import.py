"""Convert a mesh file to an object, and report the decisions that were made."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
from scipy.spatial import QhullError
from trimesh.transformations import scale_matrix, translation_matrix

from mjsim.formats.scene.mesh_files import missing_colours, read_surface
from mjsim.formats.scene.source_scene import ImportDecision, ImportOptions
from mjsim.formats.scene.surface import Floats, Surface, cleaned
from mjsim.house.validation.object_rules import SIZE
from mjsim.importing.object.closed_body import MAX_TRIANGLES, ClosedBody, Weight, close, simplified, weigh
from mjsim.importing.object.grip import Grip, find_grip
from mjsim.importing.object.parts import Parts, convex_parts
from mjsim.importing.object.resting import STEADY, RestingPose, foot, resting_pose
from mjsim.importing.object.scaling import Scaling, scaling, steadier_axis
from mjsim.importing.object.visual_mesh import VisualMesh, make_visual_mesh
from mjsim.values.errors import AssetError

_COARSE = 0.005  # maximum rounding error of coordinates, relative to the object's longest side
_FAR = 10.0  # distance from the origin that is worth reporting, relative to the longest side


@dataclass(frozen=True, eq=False)
class ImportedObject:
    """An imported object that stands on the plane z = 0, with the centre of its footprint at the origin."""

    visual: VisualMesh
    hulls: tuple[Floats, ...]  # vertices of each colliding part, in metres, shape (k, 3) each
    weight: Weight
    grip: Grip
    rolls: bool  # True if the object is round and was given a foot and rolling friction
    decisions: tuple[ImportDecision, ...]  # decisions that were made during the import, for the report

    @property
    def size(self) -> Floats:
        """The size (3,) in metres of the bounding box around all collision shapes."""
        return np.asarray(np.ptp(np.concatenate(self.hulls), axis=0))


def import_object(path: Path, options: ImportOptions) -> ImportedObject:
    """Convert a mesh file to an object. Equal files and options give bit-identical results.

    Raise an AssetError if the file cannot be read, or if a hand cannot carry the object.
    """
    _check_options(options)
    raw = read_surface(path)
    try:
        return _converted(path, raw, options)
    except AssetError as error:
        raise AssetError(f"{path}: {error}") from error
    except QhullError as error:
        raise AssetError(f"{path}: a part of it has no volume; remove the part, or thicken it") from error


def _check_options(options: ImportOptions) -> None:
    for name in ("scale", "mass", "density"):
        value = getattr(options, name)
        if value is not None and not (np.isfinite(value) and value > 0):
            raise AssetError(f"--{name} {value} is not a number above 0")
    if options.mass is not None and options.density is not None:
        raise AssetError("--mass and --density exclude each other; leave one out")


def _converted(path: Path, raw: Surface, options: ImportOptions) -> ImportedObject:
    longest, middle = _extent(raw)
    found = scaling(path.suffix.lower(), longest, units=options.units, up=options.up, scale=options.scale)
    surface, dropped = cleaned(raw.moved(scale_matrix(found.factor) @ translation_matrix(-middle)))
    if not len(surface):
        raise AssetError(f"none of its {len(raw)} triangles has an area; export it again")
    if options.up is None and path.suffix.lower() != ".glb":
        found = steadier_axis(found, surface.corners.reshape(-1, 3) + found.factor * middle)
    surface = surface.moved(found.upright)
    mesh = surface.mesh()
    solid = close(simplified(mesh, MAX_TRIANGLES))
    weight = weigh(solid.mesh, mass=options.mass, density=options.density)
    parts = convex_parts(solid)
    pose = resting_pose(parts.points, weight.centre)
    hulls = tuple(points @ pose.rotation.T for points in parts.hulls)
    if rolls := pose.tilt < STEADY:
        hulls = (*hulls, foot(np.concatenate(hulls), pose.rotation @ weight.centre))
    transform = _into_place(pose.rotation, np.concatenate(hulls))
    hulls = tuple(points + transform[:3, 3] for points in hulls)
    _check_size(np.concatenate(hulls))
    standing, weight = _on_the_floor(surface, transform), weight.moved(transform)
    look, grip = make_visual_mesh(*standing), find_grip(standing[1], weight.centre)
    decisions = (
        *_origin(path, found, raw, dropped),
        *_moved(middle, longest),
        _body(solid, len(mesh.faces)),
        ImportDecision("mass", f"{weight.mass:.3g} kg", weight.reason),
        _collision(parts),
        _rest(pose, rolls),
        _grip(grip),
        *_appearance(path, look, len(mesh.faces)),
    )
    return ImportedObject(look, hulls, weight, grip, rolls, decisions)


def _extent(surface: Surface) -> tuple[float, Floats]:
    """Return the longest side and the centre (3,) of a surface's bounding box, in the unit of the file.

    Raise an AssetError if it has no finite extent, or is too far from the origin for 32-bit coordinates.
    """
    points = surface.corners.reshape(-1, 3)
    points = points[np.isfinite(points).all(axis=1)]
    longest = float(np.ptp(points, axis=0).max()) if len(points) else 0.0
    if not (np.isfinite(longest) and longest > 0):
        raise AssetError("all its points coincide or are not finite numbers; export it again")
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    farthest = np.abs(points).max()
    is_single = np.array_equal(points, points.astype(np.float32))
    if is_single and np.spacing(np.float32(farthest)) > _COARSE * longest:
        raise AssetError(
            f"it lies {np.linalg.norm(middle):.3g} from the origin, in the file's unit, where numbers of 32 bits are "
            f"too coarse for a side of {longest:.3g}; move it to the origin and export it again"
        )
    return longest, middle


def _into_place(rotation: Floats, points: Floats) -> Floats:
    low, high = points.min(axis=0), points.max(axis=0)
    transform: Floats = translation_matrix((-(low[0] + high[0]) / 2, -(low[1] + high[1]) / 2, -low[2]))
    transform[:3, :3] = rotation
    return transform


def _on_the_floor(surface: Surface, transform: Floats) -> tuple[Surface, trimesh.Trimesh]:
    """Move a surface into place, with its lowest point on the floor even if its parts were thickened."""
    placed = surface.moved(transform)
    placed = placed.moved(translation_matrix((0, 0, -placed.corners[..., 2].min())))
    return placed, placed.mesh()


def _check_size(points: Floats) -> None:
    size = np.ptp(points, axis=0)
    if size.max() > SIZE[1] + 1e-3:
        text = " x ".join(f"{side:.2f}" for side in size)
        raise AssetError(
            f"it measures {text} m, and a hand carries {SIZE[1]} m; use --scale {SIZE[1] / size.max():.2g}"
        )
    if size.max() < SIZE[0] - 1e-3:
        raise AssetError(f"its longest side is {size.max():.3f} m, less than {SIZE[0]} m; use --scale")


def _origin(path: Path, found: Scaling, raw: Surface, dropped: dict[str, int]) -> tuple[ImportDecision, ...]:
    gone = ", ".join(f"{count} {kind}" for kind, count in dropped.items() if count)
    return (
        ImportDecision("file", path.name, f"{len(raw)} triangles" + (f"; left out: {gone}" if gone else "")),
        ImportDecision("unit", found.unit, found.unit_reason),
        ImportDecision("up", found.up, found.up_reason),
    )


def _moved(middle: Floats, longest: float) -> tuple[ImportDecision, ...]:
    away = float(np.linalg.norm(middle))
    reason = f"it lies {away:.3g} from the file's origin, in the file's unit"
    return (ImportDecision("place", "moved to the origin", reason),) if away > _FAR * longest else ()


def _body(solid: ClosedBody, faces: int) -> ImportDecision:
    notes = [f"simplified from {faces} triangles"] if faces > MAX_TRIANGLES else []
    if solid.flat:
        return ImportDecision("body", "flat sheet", "given a thickness of 1 mm")
    notes += [f"{solid.pieces} pieces joined"] * (solid.pieces > 1)
    notes += [f"holes filled in {solid.filled}"] * (solid.filled > 0)
    if solid.hulled:
        share = f"{100 * solid.open_share:.0f} % of the surface"
        notes.append(
            f"{solid.hulled} open ones ({share}) count as their convex hulls: hollows in them are lost"
        )
    return ImportDecision("body", "repaired" if solid.filled or solid.hulled else "closed", "; ".join(notes))


def _collision(parts: Parts) -> ImportDecision:
    thick = f"; {parts.thickened} thickened to 15 mm" if parts.thickened else ""
    return ImportDecision("collision", f"{len(parts.hulls)} convex", parts.reason + thick)


def _rest(pose: RestingPose, rolls: bool) -> ImportDecision:
    if rolls:
        return ImportDecision("rests", "as in the file, on a foot", "it is round and would roll away")
    degrees = f"tips over at {np.degrees(pose.tilt):.0f} degrees"
    if pose.turned:
        reason = f"on its steadiest side: {degrees}; in the file's pose it falls over"
        return ImportDecision("rests", "turned", reason)
    return ImportDecision("rests", "as in the file", degrees)


def _grip(grip: Grip) -> ImportDecision:
    if not grip.offset:
        return ImportDecision("grips", "above the centre of mass")
    aside = f"{100 * grip.offset:.0f} cm beside the centre of mass"
    return ImportDecision("grips", aside, "the nearest place at its top that is there")


def _appearance(path: Path, look: VisualMesh, faces: int) -> tuple[ImportDecision, ...]:
    how = "picture of all colours" if look.picture is not None else "one colour"
    notes = [f"simplified from {faces} triangles"] if len(look.faces) < faces else []
    notes += ["open: drawn from both sides"] if look.doubled else []
    missing = missing_colours(path)
    notes += [f"not there: {', '.join(missing)}"] if missing else []
    return (ImportDecision("look", f"{len(look.faces)} triangles, {how}", "; ".join(notes)),)
