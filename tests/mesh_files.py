"""Mesh files of many kinds, made from trimesh's primitives: `mjsim import` has to accept all of them."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import trimesh
from PIL import Image
from trimesh.visual.material import PBRMaterial, SimpleMaterial

from mjsim.formats.scene.source_scene import ImportOptions

_NOTHING = ImportOptions()
Y_UP = trimesh.transformations.rotation_matrix(-np.pi / 2, [1, 0, 0])
_MAKE = trimesh.creation


@dataclass(frozen=True)
class MeshFile:
    """A mesh file: suffix of its format, what builds it, and options and category of its import."""

    suffix: str
    build: Callable[[], Any]
    options: ImportOptions = _NOTHING
    category: str = "toys"

    def write(self, folder, name):
        path = folder / f"{name}{self.suffix}"
        made = self.build()
        if isinstance(made, bytes):
            path.write_bytes(made)
        else:
            made.export(path)
        return path


def _moved(mesh, *offset):
    return mesh.apply_translation(offset)


def _less(body, *holes):
    return trimesh.boolean.difference([body, *holes], engine="manifold")


def _cup():
    return _less(_MAKE.cylinder(0.04, 0.1, sections=40), _moved(_MAKE.cylinder(0.036, 0.1), 0, 0, 0.004))


def _hollow_ball():
    inner = _MAKE.icosphere(3, 0.055)
    inner.invert()
    return trimesh.util.concatenate([_MAKE.icosphere(3, 0.06), inner])


def _open_box():
    box = _MAKE.box((0.15, 0.1, 0.08))
    return box.submesh([np.flatnonzero(box.face_normals[:, 2] < 0.5)], append=True)


def _torn_ball():
    ball = _MAKE.icosphere(3, 0.06)
    ball.update_faces(np.arange(len(ball.faces)) % 7 != 0)
    return ball


def _table():
    legs = [_moved(_MAKE.box((0.02, 0.02, 0.1)), x, y, -0.05) for x in (-0.07, 0.07) for y in (-0.05, 0.05)]
    return trimesh.util.concatenate([_MAKE.box((0.18, 0.14, 0.02)), *legs])


def _many_parts():
    rng = np.random.default_rng(3)
    pieces = [_moved(_MAKE.icosphere(1, 0.02), *(0.12 * rng.random(3) * (1, 1, 0.4))) for _ in range(12)]
    return trimesh.util.concatenate(pieces)


def picture(size=64):
    """A checkerboard in two colours with a red border, `size` px square."""
    rows, columns = np.indices((size, size)) * 8 // size
    pixels = np.where(((rows + columns) % 2 == 0)[..., None], (250, 220, 40), (30, 60, 160)).astype(np.uint8)
    edge = size // 16
    pixels[:edge] = pixels[-edge:] = pixels[:, :edge] = pixels[:, -edge:] = (200, 20, 20)
    return Image.fromarray(pixels)


def _textured_box():
    box = _MAKE.box((0.12, 0.16, 0.03))
    box.unmerge_vertices()
    flat = box.vertices[:, :2] / box.extents[:2] + 0.5
    box.visual = trimesh.visual.TextureVisuals(uv=flat, material=PBRMaterial(baseColorTexture=picture()))
    return trimesh.Scene(box.apply_transform(Y_UP))


def _repeating_texture():
    can = _MAKE.cylinder(0.035, 0.12, sections=32)
    x, y, z = can.vertices.T
    uv = np.column_stack((3 * np.arctan2(y, x) / np.pi, 10 * z))
    can.visual = trimesh.visual.TextureVisuals(uv=uv, material=SimpleMaterial(image=picture()))
    return can.apply_transform(Y_UP)


def _vertex_colours():
    body = _MAKE.capsule(height=0.08, radius=0.035)
    share = (body.vertices[:, 2] - body.bounds[0, 2]) / body.extents[2]
    rgba = np.column_stack((255 * share, 60 + 0 * share, 255 * (1 - share), 255 + 0 * share))
    body.visual.vertex_colors = rgba.astype(np.uint8)
    return body


def _face_colours():
    box = _MAKE.box((0.1, 0.1, 0.1))
    box.visual.face_colors = np.repeat(np.eye(4, dtype=np.uint8)[[0, 1, 2, 0, 1, 2]] * 220 + 35, 2, axis=0)
    return box


def plain(mesh, *rgb):
    """A mesh with a glTF material of one linear colour from 0 to 1."""
    material = PBRMaterial(baseColorFactor=[*rgb, 1.0])
    mesh.visual = trimesh.visual.TextureVisuals(material=material)
    return mesh


def _truck():
    scene = trimesh.Scene()
    scene.add_geometry(plain(_MAKE.box((0.18, 0.07, 0.05)), 0.8, 0.05, 0.05), transform=_at(0, 0, 0.045))
    scene.add_geometry(plain(_MAKE.box((0.06, 0.07, 0.05)), 0.05, 0.1, 0.7), transform=_at(0.06, 0, 0.095))
    wheel = plain(_MAKE.cylinder(0.022, 0.015), 0.02, 0.02, 0.02)
    upright = trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0])
    for number, (x, y) in enumerate([(-0.06, -0.04), (-0.06, 0.04), (0.06, -0.04), (0.06, 0.04)]):
        place = _at(x, y, 0.022) @ upright
        scene.add_geometry(wheel, node_name=f"wheel_{number}", geom_name="wheel", transform=place)
    return scene.apply_transform(Y_UP)


def _mirrored():
    cone = plain(_MAKE.cone(0.03, 0.1), 0.1, 0.6, 0.2)
    scene = trimesh.Scene()
    scene.add_geometry(plain(_MAKE.box((0.15, 0.06, 0.03)), 0.7, 0.5, 0.1))
    for side in (-1.0, 1.0):
        scene.add_geometry(cone, transform=_at(0.04 * side, 0, 0.01) @ np.diag([side, 1, 1, 1]))
    return scene.apply_transform(Y_UP)


def _at(x, y, z):
    return np.asarray(trimesh.transformations.translation_matrix([x, y, z]))


def _inverted():
    cone = _MAKE.cone(0.05, 0.12)
    cone.invert()
    return cone


def _half_inverted():
    box = _MAKE.box((0.12, 0.08, 0.05)).subdivide()
    box.faces[::2] = box.faces[::2, ::-1]
    return trimesh.Trimesh(box.vertices, box.faces, process=False)


def _messy():
    ring = _MAKE.torus(0.06, 0.02)
    repeated, points = ring.faces[5:45][:, [1, 2, 0]], [[0, 0, 1], [3, 4, 4]]
    faces = np.concatenate((ring.faces, ring.faces[:40], repeated, points))
    return trimesh.Trimesh(ring.vertices, faces, process=False)


def _sheet():
    return trimesh.Trimesh([[0, 0, 0], [0.2, 0, 0], [0.2, 0.28, 0], [0, 0.28, 0]], [[0, 1, 2], [0, 2, 3]])


def _cloth():
    x, y = (part.ravel() for part in np.meshgrid(np.linspace(0, 0.25, 26), np.linspace(0, 0.2, 21)))
    z = 0.006 * np.sin(40 * x) * np.cos(30 * y)
    corner = np.arange(26 * 20).reshape(20, 26)[:, :-1].ravel()
    halves = (corner, corner + 1, corner + 27), (corner, corner + 27, corner + 26)
    faces = np.concatenate([np.column_stack(half) for half in halves])
    return trimesh.Trimesh(np.column_stack((x, y, z)), faces, process=False)


def _fine():
    ball = _MAKE.icosphere(6, 0.07)
    ball.vertices[:, 2] = np.clip(ball.vertices[:, 2], -0.05, 0.06)
    return ball


def _bent():
    arm = _moved(_MAKE.box((0.04, 0.15, 0.03)), 0.08, 0.06, 0)
    return trimesh.util.concatenate([_MAKE.box((0.2, 0.04, 0.03)), arm])


def _mug_on_its_side():
    handle = _less(_moved(_MAKE.torus(0.028, 0.006), 0.04, 0, 0), _turned(_MAKE.cylinder(0.037, 0.2)))
    return trimesh.boolean.union([_turned(_cup()), handle], engine="manifold")


def _turned(mesh):
    """A mesh whose upright axis lies along y."""
    return mesh.apply_transform(Y_UP)


def _frame(across, along, bar):
    return _less(_MAKE.box((across, along, bar)), _MAKE.box((across - 2 * bar, along - 2 * bar, 1)))


def _ring(radius, thickness):
    return _MAKE.torus(radius, thickness, major_sections=16, minor_sections=8)


def _hollow_box():
    return _less(_MAKE.box((0.2, 0.15, 0.1)), _moved(_MAKE.box((0.19, 0.14, 0.1)), 0, 0, 0.005))


def _basket():
    ring = _moved(_turned(_MAKE.torus(0.09, 0.006)), 0, 0, 0.04)
    bow = _less(ring, _moved(_MAKE.box((1, 1, 1)), 0, 0, -0.47))
    return trimesh.boolean.union([_hollow_box(), bow], engine="manifold")


def _bowl():
    half = _less(_MAKE.icosphere(4, 0.08), _moved(_MAKE.box((1, 1, 1)), 0, 0, 0.5))
    foot = _moved(_MAKE.cylinder(0.04, 0.02), 0, 0, -0.07)
    return _less(trimesh.boolean.union([half, foot], engine="manifold"), _MAKE.icosphere(4, 0.074))


def tetrahedron(*top):
    """A body on a triangle, with its top over one corner or over `top`."""
    corners = [[0, 0, 0], [0.2, 0, 0], [0, 0.2, 0], top or [0, 0, 0.16]]
    return trimesh.Trimesh(corners, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])


def _plate():
    return _MAKE.revolve([[0, 0], [0.08, 0], [0.11, 0.02], [0.11, 0.024], [0.08, 0.004], [0, 0.004]])


# No hand reaches into their middle: name -> what builds them.
HOLLOW = {
    "ring": lambda: _ring(0.08, 0.02),
    "wire_ring": lambda: _MAKE.torus(0.1, 0.003, minor_sections=16),
    "ring_on_edge": lambda: _turned(_ring(0.08, 0.02)),
    "letter_l": lambda: trimesh.util.concatenate(
        [_MAKE.box((0.03, 0.2, 0.03)), _moved(_MAKE.box((0.17, 0.03, 0.03)), 0.1, -0.085, 0)]
    ),
    "tetrahedron": tetrahedron,
    "mug_on_its_side": _mug_on_its_side,
    "plate": _plate,
    "bowl": _bowl,
    "frame": lambda: _frame(0.25, 0.2, 0.02),
    "hollow_box": _hollow_box,
    "basket": _basket,
    "handle": lambda: _less(_ring(0.1, 0.01), _moved(_MAKE.box((1, 1, 1)), 0, -0.5, 0)),
    "arch": lambda: _less(_MAKE.box((0.25, 0.08, 0.13)), _moved(_MAKE.box((0.2, 1, 0.13)), 0, 0, 0.03)),
}

MESHES = {
    "brick": MeshFile(".stl", lambda: _MAKE.box((0.12, 0.07, 0.05))),
    "globe": MeshFile(".stl", lambda: _MAKE.icosphere(4, 0.07)),
    "long_stick": MeshFile(".stl", lambda: _MAKE.cylinder(0.006, 0.3)),
    "flat_sheet": MeshFile(".stl", _sheet, category="recycling"),
    "cloth": MeshFile(".ply", _cloth, category="laundry"),
    "cup": MeshFile(".stl", _cup, category="dishes"),
    "hollow_ball": MeshFile(".stl", _hollow_ball),
    "tube": MeshFile(".stl", lambda: _MAKE.annulus(0.05, 0.06, 0.15), category="recycling"),
    "open_box": MeshFile(".stl", _open_box),
    "torn_ball": MeshFile(".ply", _torn_ball),
    "table": MeshFile(".stl", _table),
    "many_parts": MeshFile(".stl", _many_parts),
    "textured_box": MeshFile(".glb", _textured_box, category="books"),
    "repeating_texture": MeshFile(".glb", _repeating_texture, category="recycling"),
    "vertex_colours": MeshFile(".ply", _vertex_colours),
    "face_colours": MeshFile(".ply", _face_colours),
    "truck": MeshFile(".glb", _truck),
    "mirrored": MeshFile(".glb", _mirrored),
    "millimetres": MeshFile(".stl", lambda: _MAKE.box((90.0, 45.0, 30.0)), category="office"),
    "inches": MeshFile(".obj", lambda: _MAKE.box((4.0, 3.0, 1.0)), ImportOptions(units="in"), "office"),
    "y_up": MeshFile(".obj", lambda: _MAKE.cone(0.05, 0.12).apply_transform(Y_UP)),
    "inverted": MeshFile(".stl", _inverted),
    "half_inverted": MeshFile(".ply", _half_inverted),
    "messy": MeshFile(".ply", _messy),
    "very_fine": MeshFile(".ply", _fine),
    "bent": MeshFile(".stl", _bent, ImportOptions(mass=0.4)),
    "heavy": MeshFile(".stl", lambda: _MAKE.cylinder(0.05, 0.04), ImportOptions(mass=1.5)),
    "tiny_scaled": MeshFile(".stl", lambda: _MAKE.box((0.003, 0.002, 0.002)), ImportOptions("m", scale=40.0)),
    **{f"own_{name}": MeshFile(".stl", build, category="laundry") for name, build in HOLLOW.items()},
}
