"""Files of other programs that would run for minutes, or lose most of their shape, are refused."""

import json

import numpy as np
import pytest

from mjsim.formats.mjcf_reader import read_mjcf
from mjsim.formats.scene.mesh_files import read_parts
from mjsim.formats.scene.source_scene import HouseOptions
from mjsim.formats.scene.surface import Surface, cleaned
from mjsim.house.catalogue.model_files import ModelFile
from mjsim.values.errors import AssetError

GEOM = '<geom type="box" size=".1 .1 .1"/>'


def model(path, content):
    path.write_text(f"<mujoco><worldbody>{content}</worldbody></mujoco>")
    return path


def copies(count, content):
    return f'<replicate count="{count}" offset="1 0 0">{content}</replicate>'


@pytest.mark.parametrize(
    "content", [copies(2_000_000_000, GEOM), copies(9999, copies(9999, GEOM)), copies(10**30, GEOM)]
)
def test_too_many_copies_are_refused_before_they_are_made(tmp_path, content):
    path = model(tmp_path / "scene.xml", content)
    with pytest.raises(
        AssetError, match=r"scene.xml: its replicate elements create more than 1000000 elements"
    ):
        read_mjcf(path, HouseOptions())
    with pytest.raises(ValueError, match="reduce a count"):
        ModelFile.read(path).spec()


def test_copies_of_an_included_file_are_counted(tmp_path):
    (tmp_path / "part.xml").write_text(f"<mujocoinclude>{copies(2_000_000_000, GEOM)}</mujocoinclude>")
    with pytest.raises(AssetError, match="replicate elements"):
        read_mjcf(model(tmp_path / "scene.xml", '<include file="part.xml"/>'), HouseOptions())


def test_a_few_copies_are_read(tmp_path):
    path = model(tmp_path / "scene.xml", copies(3, copies(2, GEOM)))
    assert len(read_mjcf(path, HouseOptions()).pieces) == 6
    assert ModelFile.read(path).spec().compile().ngeom == 6


def write_gltf(path, *, count=3, copies=1):
    """Write a glTF file whose nodes share one mesh, and whose vertices are not in the file."""
    gltf = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": list(range(copies))}],
        "nodes": [{"mesh": 0}] * copies,
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"count": count, "type": "VEC3", "componentType": 5126}],
        "bufferViews": [],
        "buffers": [],
    }
    path.write_text(json.dumps(gltf))
    return path


def test_more_vertices_than_a_file_may_have_are_refused_before_they_are_made(tmp_path):
    with pytest.raises(AssetError, match="claims to have 2,000,000,000 vertices"):
        read_parts(write_gltf(tmp_path / "it.gltf", count=2_000_000_000))


def test_repeated_meshes_are_counted_before_they_are_copied(tmp_path):
    with pytest.raises(AssetError, match="has 300000000 triangles; reduce it"):
        read_parts(write_gltf(tmp_path / "it.gltf", count=300_000, copies=3000))


def surface(corners):
    blank = np.zeros((len(corners), 3, 3))
    return Surface(corners, blank, blank[..., :2], np.full(len(corners), -1))


def test_a_shape_that_would_lose_most_triangles_is_refused():
    """A tetrahedron, one corner of which is not a number, has one triangle left."""
    points = np.array([[0, 0, 0], [np.nan, 0, 0], [0, 1, 0], [0, 0, 1]], float)
    with pytest.raises(AssetError, match="3 of 4 triangles have corners that are not finite numbers"):
        cleaned(surface(points[[[0, 1, 2], [0, 1, 3], [1, 2, 3], [0, 2, 3]]]))


def test_single_broken_triangles_are_left_out_and_counted():
    rng = np.random.default_rng(0)
    corners = rng.normal(size=(300, 3, 3))
    corners[7, 0, 0] = np.inf
    kept, counts = cleaned(surface(corners))
    assert (len(kept), counts["not finite"]) == (299, 1)
