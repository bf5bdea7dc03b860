"""Writer of the meshes and label textures of object and receptacle models."""

from pathlib import Path

import cv2

from mjsim.support.files import replacing
from mjsim.values.errors import AssetError
from tools.authoring import (
    mesh_books,
    mesh_dishes,
    mesh_labels,
    mesh_laundry,
    mesh_office,
    mesh_receptacles,
    mesh_recycling,
    mesh_toys,
)
from tools.authoring.mesh_tools import LabelledMesh, write_obj


def object_meshes() -> dict[str, LabelledMesh]:
    """Return every mesh of the object models by name."""
    modules = (mesh_dishes, mesh_toys, mesh_books, mesh_laundry, mesh_office, mesh_recycling)
    return {name: surface for module in modules for name, surface in module.meshes().items()}


def receptacle_meshes() -> dict[str, LabelledMesh]:
    """Return every mesh of the receptacle models by name."""
    return mesh_receptacles.meshes()


def build_meshes(models_root: Path) -> list[Path]:
    """Write meshes and label textures below `models_root`, and return their paths in a fixed order.

    Raises:
        AssetError: A texture cannot be encoded.
    """
    written: list[Path] = []
    for folder, meshes in (("objects", object_meshes()), ("receptacles", receptacle_meshes())):
        for name, surface in meshes.items():
            path = models_root / folder / "meshes" / f"{name}.obj"
            write_obj(path, surface)
            written.append(path)
    for folder, pictures in (
        ("objects", mesh_labels.object_textures()),
        ("receptacles", mesh_labels.receptacle_textures()),
    ):
        for name, picture in pictures.items():
            path = models_root / folder / "textures" / f"{name}.png"
            with replacing(path) as temporary:
                if not cv2.imwrite(str(temporary), picture[..., ::-1]):
                    raise AssetError(f"cannot write the texture {path}; is OpenCV built with PNG support?")
            written.append(path)
    return written
