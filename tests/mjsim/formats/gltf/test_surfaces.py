"""A small independent renderer sees in exported files what MuJoCo draws, for each type of geom and texture."""

from itertools import product

import cv2
import mujoco
import numpy as np
import pytest
from glb_files import File, cast

from mjsim.formats.gltf.glb import UPRIGHT, Glb, texture_encoder
from mjsim.formats.gltf.surfaces import drawn_scene, lights_of, surfaces
from mjsim.render.cameras import ViewVolume, look_rotation
from mjsim.render.profiles import RenderProfile
from mjsim.render.rasteriser import Rasteriser
from mjsim.values.errors import AssetError

TETRAHEDRON = 'vertex="-.3 -.2 -.1 .5 -.3 -.1 0 .4 0 .1 0 .6"'
GEOMS = {
    "box": 'type="box" size=".5 .3 .2"',
    "sphere": 'type="sphere" size=".4"',
    "ellipsoid": 'type="ellipsoid" size=".5 .3 .2"',
    "capsule": 'type="capsule" size=".2 .4"',
    "cylinder": 'type="cylinder" size=".3 .4"',
    "plane": 'type="plane" size=".6 .4 1"',
    "endless plane": 'type="plane" size="0 .4 1"',
    "mesh": 'type="mesh" mesh="plain"',
    "mesh with uv": 'type="mesh" mesh="mapped"',
}
TEXTURES = {
    "none": "",
    "image": '<texture name="t" type="2d" file="4.png"/>',
    "one face": '<texture name="t" type="cube" file="4.png"/>',
    "six faces": '<texture name="t" type="cube" fileright="0.png" fileleft="1.png" fileup="2.png" filedown="3.png" '
    'filefront="4.png" fileback="5.png"/>',
}
MAPPINGS = ("", 'texrepeat="2 1.5"', 'texuniform="true" texrepeat="2 1"')
# A plane lies on the edge of its cube, where MuJoCo shows a star of single pixels drawn out.
CASES = [
    (geom, texture, mapping)
    for geom, texture, mapping in product(GEOMS, TEXTURES, MAPPINGS)
    if (texture != "none" or not mapping) and ("plane" not in geom or "face" not in texture)
]
SIDE, MIDDLE = 50, np.array([0.2, -0.1, 0.3])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Six images that show where one is on them: red to the right, green downwards, blue by number."""
    folder = tmp_path_factory.mktemp("textures")
    down, right = np.mgrid[:64, :64] / 64
    for number in range(6):
        image = np.dstack((0.2 + 0.6 * right, 0.2 + 0.6 * down, np.full_like(right, number / 5)))
        cv2.imwrite(str(folder / f"{number}.png"), (255 * image[..., ::-1]).astype(np.uint8))
    return folder


def compiled(folder, geom, texture="none", mapping="", extra=""):
    """One geom in the light that is the same everywhere."""
    name = 'texture="t"' if texture != "none" else ""
    return mujoco.MjModel.from_xml_string(
        f"""<mujoco><compiler texturedir="{folder}" angle="radian"/>
        <visual><headlight ambient="1 1 1" diffuse="0 0 0" specular="0 0 0"/>
          <quality numslices="16" numstacks="8"/></visual>
        <asset>{TEXTURES[texture]}<material name="m" {name} {mapping} rgba="1 .9 .8 1"/>
          <mesh name="plain" {TETRAHEDRON}/>
          <mesh name="mapped" {TETRAHEDRON} texcoord="0 0 1 0 1 1 0 1" face="0 2 1 0 1 3 1 2 3 2 0 3"/></asset>
        <worldbody>{extra}
          <geom name="it" {GEOMS.get(geom, geom)} material="m" pos=".2 -.1 .3" euler=".3 .2 .4"/>
        </worldbody></mujoco>"""
    )


def exported(model):
    """The file that holds all of a model, and its state."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    glb = Glb(texture_encoder(model))
    mesh = glb.mesh("all", surfaces(model, data, drawn_scene(model, data)))
    return File(glb.content(glb.node("root", [mesh], rotation=UPRIGHT))), data


def views():
    for direction in ((-1, -0.7, -0.8), (1, 0.5, -0.6)):
        yield np.array(direction) / np.linalg.norm(direction)


def shown(model):
    """What MuJoCo and the file show from each direction, (SIDE, SIDE, 3), 0 to 1."""
    file, data = exported(model)
    parts = file.parts()
    across = (np.arange(SIDE) + 0.5) / SIDE * 2 - 1
    right, up = np.meshgrid(across, -across)
    with Rasteriser(model, SIDE, SIDE, RenderProfile("plain", skybox=False)) as rasteriser:
        rasteriser.update(data)
        for direction in views():
            axes, eye = look_rotation(direction), MIDDLE - 3 * direction
            view = ViewVolume(
                position=eye, rotation=axes, half_height=0.8, near=0.1, far=6, orthographic=True
            )
            origins = eye + 0.8 * (right[..., None] * axes[:, 0] + up[..., None] * axes[:, 1])
            ours = cast(parts, origins.reshape(-1, 3), direction)
            yield rasteriser.colour(view) / 255, np.nan_to_num(ours).reshape(SIDE, SIDE, 3)


@pytest.mark.parametrize(("geom", "texture", "mapping"), CASES)
def test_each_type_of_geom_looks_as_mujoco_draws_it(folder, geom, texture, mapping):
    model = compiled(folder, geom, texture, mapping)
    for theirs, ours in shown(model):
        seen = (theirs.max(axis=2) > 0) | (ours.max(axis=2) > 0)
        wrong = np.abs(theirs - ours).max(axis=2)[seen]
        assert seen.mean() > 0.05
        assert np.median(wrong) < 0.02
        assert (wrong > 0.08).mean() < 0.4  # where an image begins again, pixels are a mixture


def test_shapes_end_where_those_of_mujoco_do(folder):
    for geom in GEOMS:
        for theirs, ours in shown(compiled(folder, geom)):
            assert ((theirs.max(axis=2) > 0) != (ours.max(axis=2) > 0)).mean() < 0.004, geom


def test_normals_are_those_of_the_surface_and_triangles_face_outwards(folder):
    for geom in GEOMS.keys() - {"mesh with uv"}:  # its normals are MuJoCo's, which makes it round
        (part,) = exported(compiled(folder, geom))[0].parts()
        a, b, c = np.moveaxis(part.positions[part.triangles], 1, 0)
        flat = np.cross(b - a, c - a)
        flat /= np.linalg.norm(flat, axis=1, keepdims=True)
        assert (np.einsum("tck,tk->tc", part.normals[part.triangles], flat) > 0.7).all(), geom


def test_colour_shine_and_opacity_are_kept():
    model = mujoco.MjModel.from_xml_string(
        """<mujoco><asset><material name="m" specular=".6" shininess=".3" emission=".2"/></asset><worldbody>
        <geom size=".1" material="m" rgba=".2 .5 .9 1"/>
        <geom size=".1" rgba=".1 .2 .3 .4" pos="1 0 0"/>
        <geom type="plane" size="1 1 1" rgba="0 0 0 .98"/>
        <geom size=".1" rgba="0 0 0 0"/><geom size=".1" group="3"/></worldbody></mujoco>"""
    )
    parts = exported(model)[0].parts()
    assert len(parts) == 3  # the invisible are left out
    first, glass, rug = parts
    np.testing.assert_allclose(first.colours[0], [0.2, 0.5, 0.9, 1], atol=1e-4)
    np.testing.assert_allclose(first.shine[0], [0.6, 0.3, 0.2], atol=1 / 255)
    np.testing.assert_allclose(glass.colours[0], [0.1, 0.2, 0.3, 0.4], atol=1e-4)
    assert not first.blended and glass.blended and rug.blended
    assert not glass.extras["decal"] and rug.extras["decal"]


def test_an_endless_plane_reaches_as_far_as_is_seen():
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><worldbody><geom type="plane" size="0 2 1" pos="0 0 .003"/></worldbody></mujoco>'
    )
    (part,) = exported(model)[0].parts()
    far = model.vis.map.zfar * model.stat.extent
    assert np.ptp(part.positions[:, 0]) > 2 * far
    np.testing.assert_allclose(np.ptp(part.positions[:, 1]), 4, atol=0.01)
    np.testing.assert_allclose(part.positions[:, 2], 0.003, atol=1e-9)  # flat things keep their height


def test_a_type_of_geom_that_cannot_be_shown_is_refused_by_name():
    model = mujoco.MjModel.from_xml_string(
        """<mujoco><asset><hfield name="h" nrow="4" ncol="4" size="1 1 1 .1"/></asset><worldbody>
        <geom name="hills" type="hfield" hfield="h"/></worldbody></mujoco>"""
    )
    with pytest.raises(AssetError, match=r"'hills' is of the type hfield.*make it a mesh"):
        exported(model)


@pytest.mark.parametrize(
    ("xml", "lights", "ambient"),
    [
        ('<light type="directional" dir="0 1 -1"/>', ["directional"], 0.1),
        ('<light cutoff="30" pos="1 2 3"/><light active="false"/>', ["spot"], 0.1),
        ('<light type="point"/>', [], 0.1),
        ("<light/>" * 12, ["spot"] * 7, 0.1),  # OpenGL has eight, one of them on the head
    ],
)
def test_the_lights_are_those_that_mujoco_switches_on(xml, lights, ambient):
    model = mujoco.MjModel.from_xml_string(f'<mujoco><worldbody>{xml}<geom size=".1"/></worldbody></mujoco>')
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    found = lights_of(drawn_scene(model, data))
    assert [light["type"] for light in found["lights"]] == lights
    assert found["headlight"]["ambient"] == [ambient] * 3


def test_without_any_light_all_is_a_little_lit():
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><visual><headlight active="0"/></visual><worldbody><geom size=".1"/></worldbody></mujoco>'
    )
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert lights_of(drawn_scene(model, data))["headlight"]["ambient"] == [0.3] * 3
