"""Read MJCF files, and compute content hashes of houses."""

import hashlib
import shutil
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import mujoco

from mjsim.house.catalogue.house_ref import models_root
from mjsim.support.files import is_file, read_bytes
from mjsim.values.errors import AssetError

MAX_ELEMENTS = 1_000_000  # maximum number of elements in an MJCF file, including replicated elements
_ROOTS = ("mujoco", "mujocoinclude")


@dataclass(frozen=True, eq=False)
class ModelFile:
    """An MJCF file and the XML elements of all files that it includes."""

    path: Path
    elements: tuple[ET.Element, ...]  # XML elements of the file and of all included files

    @classmethod
    def read(cls, path: Path) -> "ModelFile":
        """Read an MJCF file, and check that all files to which it refers can be read.

        Raises:
            OSError: The file cannot be read.
            UnicodeDecodeError: The file is not UTF-8.
            AssetError: A file to which it refers cannot be read. Only `spec` reports missing files.
        """
        content = read_bytes(path)
        content.decode("utf-8-sig")
        files = {str(path): content}
        elements = tuple(_parsed(content, str(path.parent), files))
        _read_assets(path.parent, elements, files)
        return cls(path, elements)

    def spec(self) -> mujoco.MjSpec:
        """Return an editable model with absolute asset paths. Raise a ValueError if the file is invalid."""
        check_replicates(self.elements)
        spec = mujoco.MjSpec.from_file(str(self.path))
        _name_files(spec, self.path.parent)
        return spec


def check_replicates(elements: Iterable[ET.Element]) -> None:
    """Raise a ValueError if the `replicate` elements of an MJCF file create too many elements."""
    waiting = [(element, 1) for element in elements if element.tag in _ROOTS]
    total = 0
    while waiting:
        element, copies = waiting.pop()
        count = element.get("count", "") if element.tag == "replicate" else ""
        copies *= int(count) if count.isdecimal() else 1
        total += copies
        if total > MAX_ELEMENTS:
            raise ValueError(
                f"its replicate elements create more than {MAX_ELEMENTS} elements; reduce a count"
            )
        waiting += [(child, copies) for child in element]


def read_model(path: Path, *, body: str | None = None) -> mujoco.MjSpec:
    """Read an editable model with absolute asset paths, which can be attached to another, from an MJCF file.

    Raises:
        AssetError: The file is invalid, or has no top-level body named `body`.
    """
    try:
        spec = mujoco.MjSpec.from_file(str(path))
    except ValueError as error:
        raise AssetError(f"cannot read model {path}: {error}") from error
    if body is not None and (spec.body(body) is None or spec.body(body).parent != spec.worldbody):
        raise AssetError(f"model {path} has no top-level body {body!r}")
    _name_files(spec, path.parent)
    return spec


def _name_files(spec: mujoco.MjSpec, folder: Path) -> None:
    for mesh in spec.meshes:
        mesh.file = _absolute(folder, spec.compiler.meshdir, mesh.file)
    for texture in spec.textures:
        texture.file = _texture(folder, spec.compiler.texturedir, texture.file)
        for face, file in enumerate(texture.cubefiles):
            texture.cubefiles[face] = _texture(folder, spec.compiler.texturedir, file)


def copy_house(path: Path, folder: Path) -> None:
    """Copy a house's folder and its packaged textures, so that MuJoCo can load it without this package."""
    shutil.copytree(path.parent, folder, dirs_exist_ok=True)
    found = list(elements(path))
    directory = next((e.get("texturedir", "") for e in found if e.tag == "compiler"), "")
    for name in [name for e in found if e.tag == "texture" and (name := e.get("file"))]:
        source = Path(_texture(path.parent, directory, name))
        if not (folder / directory / name).exists() and is_file(source):
            (folder / directory).mkdir(exist_ok=True)
            shutil.copyfile(source, folder / directory / name)


def elements(path: Path) -> Iterator[ET.Element]:
    """Yield all XML elements of an MJCF file and its included files. Files that are not XML are skipped."""
    yield from _elements(str(path), str(path.parent), {})


def content_hash(text: str, models: Iterable[Path]) -> str:
    """Return a hexadecimal SHA-256 hash of a text and of MJCF files with all files to which they refer.

    Missing or malformed files raise no error here. They are reported when the model is read.
    """
    files: dict[str, bytes] = {}
    for model in models:
        _read_assets(model.parent, list(_elements(str(model), str(model.parent), files)), files)
    # Files are hashed in the order of references, so that swapping two files changes the hash.
    digests = [hashlib.sha256(content).digest() for content in files.values()]
    return hashlib.sha256(b"".join([text.encode(), *digests])).hexdigest()


def _elements(path: str, folder: str, files: dict[str, bytes]) -> Iterator[ET.Element]:
    if path not in files and _read(path, files):
        yield from _parsed(files[path], folder, files)


def _parsed(content: bytes, folder: str, files: dict[str, bytes]) -> Iterator[ET.Element]:
    try:
        root = ET.fromstring(content)
    except ET.ParseError:
        return
    for element in root.iter():
        yield element
        if element.tag == "include":
            yield from _elements(f"{folder}/{element.get('file')}", folder, files)


def _read_assets(folder: Path, elements: Sequence[ET.Element], files: dict[str, bytes]) -> None:
    settings = {name: value for e in elements if e.tag == "compiler" for name, value in e.items()}
    for element in elements:
        for name in [name for name in element.attrib if name.startswith("file")]:
            kind = "texturedir" if element.tag == "texture" else "meshdir"
            place = settings.get(kind, settings.get("assetdir", ""))
            found = _read(f"{folder}/{place}/{element.get(name)}", files)
            if not found and element.tag == "texture":
                _read(_texture(folder, place, element.get(name, "")), files)


def _read(path: str, files: dict[str, bytes]) -> bool:
    if path not in files:
        try:
            files[path] = read_bytes(Path(path))
        except FileNotFoundError:
            return False
        except OSError as error:
            raise AssetError(f"cannot read {path}: {error.strerror}; give a file") from error
    return True


def _texture(folder: Path, subfolder: str, file: str) -> str:
    beside, shared = _absolute(folder, subfolder, file), models_root() / "textures" / file
    return str(shared) if file and not is_file(Path(beside)) and is_file(shared) else beside


def _absolute(folder: Path, subfolder: str, file: str) -> str:
    return str((folder / subfolder / file).resolve()) if file else file
