"""A disk cache of compressed scene files."""

import fcntl
import gzip
import hashlib
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import cv2
import mujoco

from mjsim.formats.gltf.export import export_scene, floor_json
from mjsim.formats.gltf.store import GZIP
from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.support.files import remove_leftovers, replacing, source_digest, write_folder
from mjsim.support.kernels import UNUSED

_LEVEL = 9
_COMPRESSED = (".webp",)  # file name suffixes of formats that are already compressed


def scene_hash(catalogue: Catalogue) -> str:
    """Return a hash (20 hex digits) of the house and the software that determine the scene files."""
    parts = (catalogue.content, source_digest("mjsim"), mujoco.__version__, cv2.__version__)
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:20]


def cached_scene(catalogue: Catalogue, folder: Path) -> Path:
    """Return the folder with the scene files of a house. Write the files first if they are not in the cache.

    The name of the folder is the scene hash. Compressible files are stored only as `NAME.gz`. If another
    process is writing the same files, wait until it has finished.

    Raises:
        AssetError: The house cannot be exported.
        OSError: The files cannot be written.
    """
    target = folder / scene_hash(catalogue)
    if not target.is_dir():
        folder.mkdir(parents=True, exist_ok=True)
        with _locked(folder):
            if not target.is_dir():
                remove_leftovers(folder, UNUSED, "")
                write_folder(target, dict(_stored(*file) for file in export_scene(catalogue).items()))
    os.utime(target)  # marks the folder as recently used
    return target


def view_path(catalogue: Catalogue, folder: Path) -> Path:
    """Return the path of a picture of a house. The picture is stored with the scene files, but drawn separately."""
    return folder / scene_hash(catalogue) / "view.webp"


def cached_floor(catalogue: Catalogue, scene: Path, body_radius: float) -> str:
    """Return the name of the floor data file for a trunk radius in metres. Write the file if it is missing.

    Raises:
        OSError: The file cannot be written.
    """
    name = f"floor-{body_radius!r}.json"
    path = scene / f"{name}{GZIP}"
    if not path.is_file():
        with replacing(path) as temporary:
            temporary.write_bytes(_compressed(floor_json(catalogue, body_radius)))
    return name


def _stored(name: str, content: bytes) -> tuple[str, bytes]:
    return (name, content) if name.endswith(_COMPRESSED) else (f"{name}{GZIP}", _compressed(content))


def _compressed(content: bytes) -> bytes:
    return gzip.compress(content, _LEVEL, mtime=0)


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    handle = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)
