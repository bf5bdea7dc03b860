"""Reading MJCF files, and telling by a hash whether any file of a house has changed."""

import hashlib
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Iterator
from pathlib import Path

import mujoco

from mjsim.errors import AssetError

_ASSET_FOLDERS = ("meshdir", "texturedir", "assetdir")


def read_model(path: Path, *, body: str | None = None) -> mujoco.MjSpec:
    """Read a model, with its asset files named absolutely, since attaching mixes folders.

    Args:
        path: MJCF file.
        body: Top-level body that it has to have.

    Raises:
        AssetError: The file is malformed or lacks the body.
    """
    try:
        spec = mujoco.MjSpec.from_file(str(path))
    except ValueError as error:
        raise AssetError(f"cannot read model {path}: {error}") from error
    if body is not None and (spec.body(body) is None or spec.body(body).parent != spec.worldbody):
        raise AssetError(f"model {path} has no top-level body {body!r}")
    for mesh in spec.meshes:
        mesh.file = _absolute(path.parent, spec.compiler.meshdir, mesh.file)
    for texture in spec.textures:
        texture.file = _absolute(path.parent, spec.compiler.texturedir, texture.file)
        for face, file in enumerate(texture.cubefiles):
            texture.cubefiles[face] = _absolute(path.parent, spec.compiler.texturedir, file)
    return spec


def content_hash(text: str, models: Iterable[Path]) -> str:
    """64 hex digits over a text and the bytes of MJCF files, with every file that they include or refer to.

    A file that cannot be read or parsed counts as it is: reading the model reports what is wrong with it.
    """
    digest = hashlib.sha256(text.encode())
    files = {file for model in models for file in (model, *_references(model, model.parent))}
    for content in sorted(hashlib.sha256(file.read_bytes()).digest() for file in files):
        digest.update(content)
    return digest.hexdigest()


def _references(path: Path, folder: Path) -> Iterator[Path]:
    """Existing files that an MJCF file names, included files first; `folder` is that of the outermost file."""
    try:
        root = ET.fromstring(path.read_bytes())
    except ET.ParseError:
        return
    for include in root.iter("include"):
        included = folder / include.get("file", "")
        if included.is_file() and included != path:
            yield included
            yield from _references(included, folder)
    folders = {"", *(c.get(name, "") for c in root.iter("compiler") for name in _ASSET_FOLDERS)}
    names = {value for e in root.iter() for name, value in e.attrib.items() if name.startswith("file")}
    yield from filter(Path.is_file, (folder / sub / name for sub in folders for name in names))


def _absolute(folder: Path, subfolder: str, file: str) -> str:
    return str((folder / subfolder / file).resolve()) if file else file
