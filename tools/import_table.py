"""Import the public scenes of `import_scenes.toml`, and print the table of docs/import.md.

`python -m tools.import_table FOLDER [NAME ...]` expects the commits of that file below FOLDER. With names, it imports
only the scenes whose row contains one of them. A scene is usable if each model is where the source places it, and if
the house keeps the rules of a usable house.
"""

import re
import sys
import tempfile
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from trimesh.transformations import compose_matrix, euler_from_matrix

from mjsim.formats.scene.source_scene import HouseOptions
from mjsim.formats.scene.surface import Floats
from mjsim.formats.sdf import read_sdf
from mjsim.importing.house.house_import import import_house
from mjsim.importing.house.plausibility import RULES
from mjsim.support.files import read_text
from mjsim.support.toml import read_toml
from mjsim.values.errors import AssetError, brief

SCENES = Path(__file__).with_name("import_scenes.toml")
_CLOSE = 0.1  # maximum distance between the imported and the source's position of a point, in metres
_HEAD = (
    "| scene | models in place | outline | size | rooms | places | result |\n|---|---|---|---|---|---|---|"
)


@dataclass(frozen=True)
class SceneRow:
    """The result of importing a scene."""

    name: str
    in_place: int = 0  # number of models that are where the source places them
    models: int = 0  # number of models in the source, or 0 if the scene is refused
    outline: str = ""
    size: str = ""
    rooms: str = ""
    places: str = ""
    fault: str = ""  # reason why the scene is refused or not usable, or an empty string

    def __str__(self) -> str:
        cells = (self.outline, self.size, self.rooms, self.places, self.fault or "**usable**")
        places = f"{self.in_place} of {self.models}" if self.models else ""
        return f"| {self.name} | {places} | {' | '.join(cells)} |"


def main(folder: Path, names: Sequence[str]) -> None:
    found = read_toml(SCENES)
    folders = [folder / repository.replace("/", "+") for repository in found["commits"]]
    models = tuple(path for one in folders for path in (one / "models", one) if path.is_dir())
    sys.stdout.write(f"{_HEAD}\n")
    for repository, scenes in found["scenes"].items():
        for scene in scenes:
            source = folder / repository.replace("/", "+") / scene
            name = f"{repository.partition('/')[2]}/{Path(scene).name}"
            if not names or any(wanted in name for wanted in names):
                sys.stdout.write(f"{scene_row(name, source, models)}\n")
                sys.stdout.flush()


def scene_row(name: str, source: Path, models: tuple[Path, ...]) -> SceneRow:
    """Import a scene into a temporary folder."""
    options = HouseOptions(models=models, skip_missing=True)
    try:
        with tempfile.TemporaryDirectory() as folder:
            decisions, report = import_house(source, Path(folder) / "house", options)
    except AssetError as error:
        reason = str(error).replace(f"{source} ", "").rpartition(": ")[2]
        return SceneRow(name, fault=f"refused: {brief(reason)}")
    near = [distance <= _CLOSE for distance in distances(source, options)]
    in_place, count = sum(near), len(near)
    outline = next(decision.choice for decision in decisions if decision.what == "outline")
    points = next((d.reason.split()[0] for d in decisions if d.what == "points"), "40 or more")
    size, rooms = report.facts["size"], report.facts["rooms"]
    faults = [finding.message for finding in report.findings if finding.rule in RULES]
    faults += [f"{count - in_place} models elsewhere"] * (in_place < count)
    return SceneRow(name, in_place, count, outline, size, rooms, points, "; ".join(faults))


def distances(source: Path, options: HouseOptions) -> Iterator[float]:
    """Yield the largest distance between the imported and the expected points of each model, in metres.

    The expected points are those of the model at the origin, moved to the pose that the source gives to the model.
    Models that the source scales are left out.
    """
    root = ET.fromstring(re.sub(r"<\?xml[^>]*\?>", "", read_text(source), count=1))
    world = root.find("world")
    assert world is not None  # noqa: S101 - all scenes of the list are worlds
    poses = dict(_poses(world))
    for state in world.findall("state"):
        poses |= dict(_poses(state))
        for model in state.findall("model"):
            if set((model.findtext("scale") or "1").split()) != {"1"}:
                poses.pop(model.get("name", ""), None)
            _move_links(world, model)
        world.remove(state)
    for model in (*world.findall("model"), *world.findall("include")):
        for pose in model.findall("pose"):
            model.remove(pose)
        ET.SubElement(model, "pose").text = "0 0 0 0 0 0"
    near = tuple(place / end for place in (source.parent, source.parent.parent) for end in ("", "models"))
    with tempfile.TemporaryDirectory() as folder:
        centred = Path(folder) / "centred.world"
        ET.ElementTree(root).write(centred)
        expected = _points(centred, HouseOptions(models=(*options.models, *near), skip_missing=True))
    found = _points(source, options)
    for name, points in expected.items():
        if name in poses and name in found:
            moved = points @ poses[name][:3, :3].T + poses[name][:3, 3]
            same = len(moved) == len(found[name])
            yield float(np.linalg.norm(moved - found[name], axis=1).max()) if same else np.inf


def _move_links(world: ET.Element, saved: ET.Element) -> None:
    """Give the links of a model, such as the lid of a chest, their saved poses relative to the model."""
    model = next((m for m in world.findall("model") if m.get("name") == saved.get("name")), None)
    if model is None:
        return
    for link in saved.findall("link"):
        own = next((one for one in model.findall("link") if one.get("name") == link.get("name")), None)
        if own is None:
            continue
        for pose in own.findall("pose"):
            own.remove(pose)
        relative = np.linalg.inv(_transform(saved)) @ _transform(link)
        values = (*relative[:3, 3], *euler_from_matrix(relative))
        ET.SubElement(own, "pose").text = " ".join(f"{value:.17g}" for value in values)


def _transform(element: ET.Element) -> Floats:
    pose = np.array((element.findtext("pose") or "0 0 0 0 0 0").split(), float)
    return np.asarray(compose_matrix(translate=pose[:3], angles=pose[3:]))


def _poses(parent: ET.Element) -> Iterator[tuple[str, Floats]]:
    """Yield name and pose of each model whose name is unique. Most includes without a name have that of their file."""
    elements = [*parent.findall("model"), *parent.findall("include")]
    uris = [(element.findtext("uri") or "").strip() for element in elements]
    names = [
        element.get("name") or element.findtext("name") or uri.rpartition("/")[2]
        for element, uri in zip(elements, uris, strict=True)
    ]
    counts = Counter(names)
    for element, name in zip(elements, names, strict=True):
        if counts[name] == 1:
            yield name, _transform(element)


def _points(source: Path, options: HouseOptions) -> dict[str, Floats]:
    """Return the centres of the triangles of each model, shape (n, 3)."""
    found: dict[str, list[Floats]] = {}
    for piece in read_sdf(source, options).pieces:
        found.setdefault(piece.name, []).append(piece.surface.corners.mean(axis=1))
    return {name: np.concatenate(points) for name, points in found.items()}


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
