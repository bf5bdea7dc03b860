"""Export a house as plain MJCF, which consists of one XML file and a folder of assets."""

import hashlib
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import mujoco

from mjsim.house.scene.scene import Scene
from mjsim.support.files import replacing, write_text_atomically
from mjsim.values.errors import AssetError

ASSETS = "assets"


def export_house(scene: Scene, path: Path) -> None:
    """Write a scene as a self-contained MJCF model that starts in the current state of the scene.

    The current state is stored as the reference pose `qpos0`. Meshes and textures are copied into the folder
    `assets` next to the file, and their names contain a hash. Paths are relative, so the folder can be moved.
    The XML file is written last, atomically.

    Raises:
        AssetError: The path does not end in `.xml`, or an asset file is missing.
    """
    if path.suffix != ".xml":
        raise AssetError(f"cannot export to {path}: MuJoCo reads models from files that end in .xml")
    try:
        root = ET.fromstring(scene.spec.to_xml())
    except ValueError as error:  # raised if MuJoCo cannot compile the model from its files
        raise AssetError(f"cannot export to {path}: {error}") from error
    for compiler in root.findall("compiler"):
        for folder in ("meshdir", "texturedir", "assetdir"):
            compiler.attrib.pop(folder, None)
    for asset in root.iterfind("asset/*"):
        for attribute in [a for a in asset.attrib if a.startswith("file")]:
            asset.set(attribute, _copy_asset(Path(asset.attrib[attribute]), path.parent))
    _sharpen_poses(root, scene.model)
    ET.indent(root)
    write_text_atomically(path, ET.tostring(root, encoding="unicode") + "\n")


def _copy_asset(source: Path, folder: Path) -> str:
    try:
        content = source.read_bytes()
    except OSError as error:
        raise AssetError(f"cannot read asset {source}: {error.strerror}") from error
    # The hash distinguishes files that have the same name in different folders.
    name = f"{source.stem}-{hashlib.sha256(content).hexdigest()[:12]}{source.suffix}"
    target = folder / ASSETS / name
    if not target.exists():
        with replacing(target) as temporary:
            temporary.write_bytes(content)
    return f"{ASSETS}/{name}"


def _sharpen_poses(root: ET.Element, model: mujoco.MjModel) -> None:
    """Rewrite the poses that determine `qpos0` with full precision. MuJoCo writes only six digits."""
    world = root.find("worldbody")
    for body in [] if world is None else _top_level_bodies(world):
        if body.find("joint") is not None or body.find("freejoint") is not None:
            compiled = model.body(body.get("name"))
            body.set("pos", _digits(compiled.pos))
            body.set("quat", _digits(compiled.quat))
    for joint in root.iterfind("worldbody//joint"):
        if joint.get("type") not in ("free", "ball"):
            compiled = model.joint(joint.get("name"))
            joint.set("axis", _digits(compiled.axis))
            joint.set("ref", _digits(model.qpos0[compiled.qposadr]))


def _top_level_bodies(parent: ET.Element) -> list[ET.Element]:
    bodies = parent.findall("body")
    for frame in parent.findall("frame"):
        if not set(frame.attrib) & {"pos", "quat", "axisangle", "xyaxes", "zaxis", "euler"}:
            bodies += _top_level_bodies(frame)
    return bodies


def _digits(values: Any) -> str:
    return " ".join(repr(float(v)) for v in values)
