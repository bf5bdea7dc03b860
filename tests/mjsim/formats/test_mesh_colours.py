"""Colours, textures and opacity of mesh files, and the files to which they refer."""

import base64
import io
import json

import numpy as np
import pytest
import trimesh
from PIL import Image

from mjsim.formats.scene.mesh_files import missing_colours, read_parts, read_surface

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1]], "f4")
UV = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], "f4")


def uri(content, kind="application/octet-stream"):
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"


def png(pixels):
    out = io.BytesIO()
    Image.fromarray(np.array(pixels, np.uint8)).save(out, "png")
    return uri(out.getvalue(), "image/png")


def write_quads(path, materials, *, shades=None, pixels=None):
    """Write a glTF file with a mesh that has one square for each material, with colours (4, 4) of its vertices."""
    arrays = [CORNERS, UV, np.array([0, 1, 2, 0, 2, 3], "u2")]
    kinds = [("VEC3", 5126), ("VEC2", 5126), ("SCALAR", 5123)]
    attributes = {"POSITION": 0, "TEXCOORD_0": 1}
    if shades is not None:
        arrays.append(np.rint(np.array(shades) * 65535).astype("u2"))
        kinds.append(("VEC4", 5123))
        attributes["COLOR_0"] = 3
    places = np.cumsum([0, *(a.nbytes for a in arrays)]).tolist()
    views = [
        {"buffer": 0, "byteOffset": p, "byteLength": a.nbytes} for p, a in zip(places, arrays, strict=False)
    ]
    accessors = [
        {"bufferView": k, "count": len(a), "type": kind, "componentType": code, "normalized": k == 3}
        for k, (a, (kind, code)) in enumerate(zip(arrays, kinds, strict=True))
    ]
    primitives = [{"attributes": attributes, "indices": 2, "material": k} for k in range(len(materials))]
    texture = {"textures": [{"source": 0}], "images": [{"uri": png(pixels)}]} if pixels is not None else {}
    gltf = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": "wall", "mesh": 0}],
        "meshes": [{"name": "wall", "primitives": primitives}],
        "materials": materials,
        **texture,
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": places[-1], "uri": uri(b"".join(a.tobytes() for a in arrays))}],
    }
    path.write_text(json.dumps(gltf))
    return path


def textured(**more):
    return {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}, **more}


def test_vertex_colours_multiply_the_texture_and_are_linear(tmp_path):
    shades = [[0.214, 0.214, 0.0, 1.0]] * 4  # sRGB 0.5
    path = write_quads(tmp_path / "it.gltf", [textured()], shades=shades, pixels=np.full((2, 2, 3), 204))
    (part,) = read_parts(path)
    np.testing.assert_allclose(part.surface.colours[0, 0], (0.5, 0.5, 0.0), atol=0.005)
    seen = part.surface.colours_at(np.array([0]), np.array([[0.4, 0.3, 0.3]]))
    np.testing.assert_allclose(seen, [[0.4, 0.4, 0.0]], atol=0.005)


def test_vertex_colours_multiply_the_colour_of_the_material(tmp_path):
    materials = [{}, {"pbrMetallicRoughness": {"baseColorFactor": [0.5, 1.0, 0.0, 1.0]}}]
    path = write_quads(tmp_path / "it.gltf", materials, shades=[[0.5, 0.214, 0.5, 1.0]] * 4)
    plain, green = read_parts(path)
    np.testing.assert_allclose(plain.surface.colours[0, 0], (0.735, 0.5, 0.735), atol=0.005)
    np.testing.assert_allclose(green.surface.colours[0, 0], (0.537, 0.5, 0.0), atol=0.005)


@pytest.mark.parametrize(
    ("material", "alpha", "seen"),
    [
        ({"alphaMode": "BLEND"}, 60, False),
        ({"alphaMode": "BLEND"}, 255, True),
        ({"alphaMode": "MASK"}, 60, False),
        ({}, 60, True),  # the alpha channel of an opaque material has no meaning
    ],
)
def test_translucent_parts_are_not_seen(tmp_path, material, alpha, seen):
    path = write_quads(tmp_path / "it.gltf", [textured(**material)], pixels=[[[90, 90, 90, alpha]] * 2] * 2)
    assert [part.seen for part in read_parts(path)] == [seen]


@pytest.mark.parametrize(("factor", "shade"), [(0.3, 1.0), (1.0, 0.3)])
def test_the_alpha_of_a_material_and_of_vertices_counts(tmp_path, factor, shade):
    material = {"alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, factor]}}
    path = write_quads(tmp_path / "it.gltf", [material], shades=[[1.0, 1.0, 1.0, shade]] * 4)
    assert not read_parts(path)[0].seen


def test_transparent_pixels_of_a_decal_take_the_colour_of_the_others(tmp_path):
    pixels = np.full((4, 4, 4), 255)
    pixels[0] = 0  # transparent black
    pixels[1:, :, 0] = 100
    (part,) = read_parts(
        write_quads(tmp_path / "it.gltf", [textured(alphaMode="BLEND")], pixels=pixels.tolist())
    )
    assert part.seen
    np.testing.assert_allclose(part.surface.images[0], np.tile([100 / 255, 1, 1], (4, 4, 1)))


def test_parts_of_a_mesh_with_several_materials_are_named_after_its_node(tmp_path):
    path = write_quads(tmp_path / "it.gltf", [{"name": "a"}, {"name": "b"}])
    assert [part.name for part in read_parts(path)] == ["wall", "wall"]


def write_scanned(folder):
    """Write a textured cube in the layout of a Gazebo model."""
    for part in ("meshes", "materials/textures"):
        (folder / part).mkdir(parents=True)
    box = trimesh.creation.box((0.1, 0.1, 0.1))
    box.visual = trimesh.visual.TextureVisuals(
        uv=np.zeros((8, 2)), image=Image.new("RGB", (4, 4), (200, 30, 40))
    )
    box.export(folder / "meshes" / "model.obj")
    (picture,) = (folder / "meshes").glob("*.png")
    picture.rename(folder / "materials" / "textures" / picture.name)
    return folder / "meshes" / "model.obj"


def test_textures_are_found_where_gazebo_models_keep_them(tmp_path):
    path = write_scanned(tmp_path / "cube")
    assert missing_colours(path) == ()
    for surface in (read_surface(path), read_parts(path)[0].surface):
        np.testing.assert_allclose(surface.images[0][0, 0], np.array([200, 30, 40]) / 255)
    next((tmp_path / "cube" / "materials" / "textures").glob("*.png")).unlink()
    assert len(missing_colours(path)) == 1


def test_a_texture_outside_of_the_folders_of_a_mesh_is_not_read(tmp_path):
    path = write_scanned(tmp_path / "models" / "cube")
    (picture,) = (tmp_path / "models" / "cube" / "materials" / "textures").glob("*.png")
    picture.rename(tmp_path / picture.name)
    material = next(path.parent.glob("*.mtl"))
    material.write_text(material.read_text().replace(picture.name, f"../../../{picture.name}"))
    assert read_surface(path).images == ()
