"""Write the meshes and label textures of object and receptacle models."""

from pathlib import Path

import cv2

from mjsim.support.files import replacing
from mjsim.values.errors import AssetError
from tools.authoring import (
    mesh_labels,
    mesh_laundry,
    mesh_office,
    mesh_receptacles,
    mesh_small_objects,
)
from tools.authoring.mesh_tools import LabelledMesh, write_obj


def object_meshes() -> dict[str, LabelledMesh]:
    small = mesh_small_objects
    groups = (small.dishes, small.toys, small.books, mesh_laundry.meshes, mesh_office.meshes, small.recycling)
    return {name: surface for group in groups for name, surface in group().items()}


def receptacle_meshes() -> dict[str, LabelledMesh]:
    return mesh_receptacles.meshes()


def build_meshes(models_root: Path) -> list[Path]:
    """Write the meshes and label textures below `models_root`. Return their paths in a fixed order.

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
