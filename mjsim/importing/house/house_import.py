"""Import a house from a scene of another simulator, and report the decisions that were made."""

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path

import numpy as np
from trimesh.transformations import translation_matrix

from mjsim.formats.gltf.reader import INSTANCE, read_habitat, read_mesh_scene
from mjsim.formats.mjcf_reader import SUFFIXES as MJCF
from mjsim.formats.mjcf_reader import read_mjcf
from mjsim.formats.procthor.reader import SUFFIXES as PROCTHOR
from mjsim.formats.procthor.reader import read_procthor
from mjsim.formats.robocasa import SUFFIXES as ROBOCASA
from mjsim.formats.robocasa import read_robocasa
from mjsim.formats.scene.mesh_files import MAX_TRIANGLES
from mjsim.formats.scene.mesh_files import SCENE_SUFFIXES as MESHES
from mjsim.formats.scene.source_scene import (
    HouseOptions,
    ImportDecision,
    ScenePiece,
    SourceScene,
    left_out,
    moved,
    words_of,
)
from mjsim.formats.scene.surface import Floats
from mjsim.formats.sdf import SUFFIXES as SDF
from mjsim.formats.sdf import read_sdf
from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.check import CheckReport, check_house_name
from mjsim.house.validation.findings import Finding, errors
from mjsim.importing.house.bins import place_bins, without_bins
from mjsim.importing.house.drawn_meshes import make_drawn_meshes
from mjsim.importing.house.floor_grid import FloorGrid, make_floor_grid, too_large
from mjsim.importing.house.plausibility import doubts
from mjsim.importing.house.rooms import find_rooms, read_rooms
from mjsim.importing.house.solids import HIGH, LOW, Solids, make_solids
from mjsim.importing.house.storey import FAR, counted, floor_and_ceiling, near_pieces, of_one_storey
from mjsim.importing.house.writer import ImportedHouse, set_points, write_house
from mjsim.importing.object.model_writer import write_png
from mjsim.support.files import work_folder
from mjsim.values.episode import POINTS
from mjsim.values.errors import AssetError, RenderError

REPORT, PICTURE = "report.json", "preview.png"
_FLOOR_SEEN = 0.8  # share of the floor that the source must draw so that no floor is added
_FEW = 4  # minimum number of obstacles in a house that has no walls
# Size of a door leaf in metres: maximum thickness, range of widths and range of heights.
_DOOR = (0.3, (0.45, 3.0), (1.6, 2.8))


def import_house(
    source: Path, out: Path, options: HouseOptions, *, label: str | None = None, force: bool = False
) -> tuple[tuple[ImportDecision, ...], CheckReport]:
    """Import a scene as a house into a new folder. Return the import decisions and the check report.

    Raises:
        AssetError: The scene cannot be read, is not a house or fails the check, or the folder exists.
            Nothing is written.
    """
    if out.exists() and not force:
        raise AssetError(f"{out} is already there; choose another --out, or use --force to replace it")
    if out.exists() and not (out / REPORT).is_file():
        raise AssetError(f"{out} is not an imported house and is not replaced; choose another --out")
    scene = read_scene(source, options)
    try:
        house, decisions = _converted(scene, source, options, label)
    except AssetError as error:
        raise AssetError(f"{source}: {_without(scene)}{error}") from error
    out.parent.mkdir(parents=True, exist_ok=True)
    with work_folder(out.parent) as work:
        new = work / "new"
        new.mkdir()
        path = write_house(house, new, Catalogue.load())
        report = check_house_name(str(path))
        if found := errors(report.findings):
            raise AssetError(f"{source}: {_refusal(found)}")
        fits = int(report.facts["points that fit"].split()[0])
        unusual = tuple(doubts(house.grid, fits))
        if fits < POINTS:  # Use fewer points than fit, because other random samples may leave larger gaps.
            points = max(fits - 2, 1)
            set_points(path, points)
            report = replace(
                report,
                findings=tuple(f for f in report.findings if f.rule != "points"),
                facts={**report.facts, "points that fit": f"{points} or more"},
            )
            decisions.append(
                ImportDecision("points", f"{points}", f"{fits} places for objects a metre apart")
            )
        if (note := _write_picture(path, new / PICTURE)) is not None:
            decisions.append(note)
        text = json.dumps([asdict(decision) for decision in decisions], indent=2, ensure_ascii=False)
        (new / REPORT).write_text(text + "\n", encoding="utf-8")
        if out.exists():
            out.rename(work / "old")
        new.rename(out)
    return tuple(decisions), replace(report, findings=(*report.findings, *unusual))


def _without(scene: SourceScene) -> str:
    lacking = [note for note in scene.notes if note.choice.endswith(" missing")]
    return "".join(f"{note.choice} ({note.reason}), and what is left " for note in lacking)


def _refusal(found: Sequence[Finding]) -> str:
    more = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
    subject = "" if found[0].subject == "house" else f"{found[0].subject} "
    return f"the house made of it cannot be used: {subject}{found[0].message}{more}; correct the source"


def read_scene(source: Path, options: HouseOptions) -> SourceScene:
    """Read a scene from a file. Raise an AssetError if its type is unknown or the file cannot be read."""
    if not source.is_file():
        raise AssetError(f"{source} is not a file; check the path")
    for endings, read in _READERS:
        if source.name.lower().endswith(endings):
            return read(source, options)
    known = ", ".join(ending for endings, _ in _READERS for ending in endings)
    raise AssetError(f"cannot read {source}: unknown kind of file; use {known}")


_READERS: tuple[tuple[tuple[str, ...], Callable[[Path, HouseOptions], SourceScene]], ...] = (
    (SDF, read_sdf),
    (MJCF, read_mjcf),
    (MESHES, read_mesh_scene),
    ((INSTANCE,), read_habitat),
    (PROCTHOR, read_procthor),
    (ROBOCASA, read_robocasa),
)


def _converted(
    scene: SourceScene, source: Path, options: HouseOptions, label: str | None
) -> tuple[ImportedHouse, list[ImportDecision]]:
    if (count := sum(len(piece.surface) for piece in scene.pieces)) > MAX_TRIANGLES:
        raise AssetError(f"has {count:,} triangles; reduce it to {MAX_TRIANGLES:,} or fewer")
    near, far = near_pieces(scene.pieces)
    level, ceiling = floor_and_ceiling(near) if options.floor is None else (options.floor, np.inf)
    pieces = moved(near, translation_matrix([0, 0, -level]))
    decisions = [
        ImportDecision("source", source.name, f"{scene.kind}, {counted(len(pieces), 'shape')}"),
        ImportDecision(
            "floor", f"z = {level:.3f} m", "the lowest large level area" if options.floor is None else "given"
        ),
    ]
    decisions += [*scene.notes, *far]
    catalogue = Catalogue.load()
    given_bins = tuple(replace(b, z=b.z - level) for b in scene.bins)
    pieces = without_bins(pieces, [b for b in given_bins if b.key in catalogue.receptacles], catalogue)
    pieces, notes = of_one_storey(pieces, ceiling - level)
    decisions += notes
    _check_span(pieces)
    doors = [piece for piece in pieces if _is_door(piece)]
    still = [piece for piece in pieces if not _is_door(piece)]
    solids = make_solids(still)
    if not solids.solids and any(piece.seen and not piece.solid for piece in still):
        still = [replace(piece, solid=piece.seen) for piece in still]
        solids = make_solids(still)
        decisions.append(
            ImportDecision("solid", "visual meshes", "the collision meshes of the source do not form a house")
        )
    if not solids.solids:
        raise AssetError("has no walls and no furniture; is it a house?")
    floor = _floor(still)
    leaves = make_solids(doors)
    grid = make_floor_grid(solids.solids, leaves.solids, floor)
    opened = {leaf.name for leaf in leaves.solids if _between_rooms(grid, leaf.outline)}
    kept = [leaf for leaf in leaves.solids if leaf.name not in opened]
    solids = Solids((*solids.solids, *kept), solids.boxes, solids.hulls, solids.voxels, solids.pitch)
    grid = make_floor_grid(solids.solids, [leaf for leaf in leaves.solids if leaf.name in opened], floor)
    if not grid.enclosed and len(solids.solids) < _FEW:
        raise AssetError(f"has no walls and only {len(solids.solids)} obstacles; is it a house?")
    drawn = [piece for piece in pieces if piece.name not in opened]
    given = read_rooms(options.rooms) if options.rooms is not None else scene.rooms
    rooms = find_rooms(grid, given, drawn)
    kept_bins = all(b.key in catalogue.receptacles and b.room in dict(rooms.names) for b in given_bins)
    bins = given_bins if given_bins and kept_bins else place_bins(grid, rooms, catalogue)
    if lost := [room.label for room in given if room.key not in dict(rooms.names)]:
        decisions.append(left_out(", ".join(lost), "unreachable, or too small for a person"))
    looks = make_drawn_meshes(drawn, partial(grid.on, rooms.floor))
    seen = float((grid.floor & rooms.floor).sum() / rooms.floor.sum())
    name = label or source.name.split(".")[0].replace("_", " ").strip().capitalize()
    house = ImportedHouse(name, source.name, solids.solids, looks, grid, rooms, bins, seen >= _FLOOR_SEEN)
    triangles = sum(len(mesh.visual.faces) for mesh in looks)
    pictures = len({id(mesh.visual.picture) for mesh in looks if mesh.visual.picture is not None})
    if doors:
        choice = f"{len(opened)} open" if opened else "as they are"
        decisions.append(ImportDecision("doors", choice, ", ".join(sorted(opened)[:6])))
    decisions += [
        ImportDecision(
            "collision",
            f"{counted(len(solids.solids), 'convex geom')}",
            f"{solids.boxes} boxes, {solids.hulls} hulls, {solids.voxels} boxes of {100 * solids.pitch:g} cm voxels",
        ),
        ImportDecision(
            "outline",
            "closed by its walls" if grid.enclosed else "a rectangle",
            f"{grid.area:.0f} m2 can be walked on" if grid.enclosed else "no outer wall encloses a floor",
        ),
        ImportDecision("rooms", ", ".join(text for _, text in rooms.names), rooms.reason),
        ImportDecision(
            "bins",
            ", ".join(f"{b.key} in {b.room}" for b in bins),
            "of the source" if bins is given_bins else "against walls, ways stay open",
        ),
        ImportDecision("look", counted(triangles, "triangle"), f"{len(looks)} meshes, {pictures} pictures"),
        ImportDecision(
            "drawn floor",
            "of the source" if house.floor_seen else "added",
            f"the source draws {100 * seen:.0f} % of it",
        ),
    ]
    return house, decisions


def _check_span(pieces: Sequence[ScenePiece]) -> None:
    """Raise an AssetError if a scene is much too large for a house. Its voxels would not fit into memory."""
    standing = [p.surface.corners.reshape(-1, 3) for p in pieces if p.solid]
    high = [corners for corners in standing if corners[:, 2].max() > LOW and corners[:, 2].min() < HIGH]
    sides = np.ptp(np.concatenate(high)[:, :2], axis=0) if high else np.zeros(2)
    if sides.max() > FAR:
        raise too_large(sides)


def _is_door(piece: ScenePiece) -> bool:
    if not {"door", "doors"} & set(words_of(piece.name)):
        return False
    x, y, height = np.ptp(piece.surface.corners.reshape(-1, 3), axis=0)
    thickness, (narrow, wide), (low, high) = _DOOR
    return bool(min(x, y) <= thickness and narrow <= max(x, y) <= wide and low <= height <= high)


def _between_rooms(grid: FloorGrid, outline: Floats) -> bool:
    low, high = outline.min(axis=0), outline.max(axis=0)
    middle, across = (low + high) / 2, int(np.argmin(high - low))
    offset = np.zeros(2)
    offset[across] = 0.5
    return all(grid.indoors[grid.cell(middle + sign * offset)] for sign in (-1, 1))


def _floor(pieces: Sequence[ScenePiece]) -> Floats:
    found = [
        p.surface.corners[np.abs(p.surface.corners[:, :, 2]).max(axis=1) < LOW] for p in pieces if p.seen
    ]
    return np.concatenate([np.empty((0, 3, 3)), *found])[:, :, :2]


def _write_picture(catalogue: Path, out: Path) -> ImportDecision | None:
    """Draw the house from above. If this fails, for example without OpenGL, return a line for the report."""
    from mjsim.house.compiled.house import compiled_house
    from mjsim.render.pictures import render_house_map

    loaded = Catalogue.load(str(catalogue))
    try:
        write_png(out, render_house_map(loaded, compiled_house(loaded).rooms.bounds, 60.0)[..., :3])
    except (RenderError, AssetError) as error:
        return ImportDecision("picture", "none", str(error))
    return None
