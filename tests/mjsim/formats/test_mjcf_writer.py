"""An exported house is plain MJCF: stock MuJoCo opens it from anywhere, and it moves like the original."""

import json
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET

import mujoco
import numpy as np
import pytest
from small_worlds import scene_of

from mjsim.formats.mjcf_writer import export_house
from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.scene import avatar
from mjsim.house.scene.scene import compose
from mjsim.values.errors import AssetError

START = (1.5, 2.5, 0.0)
STOCK = """
import json, sys
import mujoco
model = mujoco.MjModel.from_xml_path(sys.argv[1])
data = mujoco.MjData(model)
qpos0 = model.qpos0.tolist()
mujoco.mj_step(model, data)
names = [model.body(i).name for i in range(model.nbody)]
sizes = {k: getattr(model, k) for k in ("nbody", "ngeom", "nq", "nv", "nu", "neq", "nmesh", "ntex", "nmat")}
print(json.dumps({"sizes": sizes, "qpos0": qpos0, "qpos": data.qpos.tolist(), "names": names,
    "sleep": bool(model.opt.enableflags & mujoco.mjtEnableBit.mjENBL_SLEEP), "step": model.opt.timestep,
    "mjsim": "mjsim" in sys.modules}))
"""


@pytest.fixture(scope="module")
def exported(scene, tmp_path_factory):
    path = tmp_path_factory.mktemp("export") / "first" / "house.xml"
    export_house(scene, path)
    return path


@pytest.mark.slow
def test_stock_mujoco_opens_it_from_another_folder(exported, scene, tmp_path):
    moved = tmp_path / "moved"
    shutil.copytree(exported.parent, moved)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    out = subprocess.run(
        [sys.executable, "-c", STOCK, str(moved / "house.xml")],
        cwd=elsewhere, capture_output=True, text=True, check=True,
    ).stdout  # fmt: skip
    stock = json.loads(out)
    model, data = scene.model, mujoco.MjData(scene.model)
    assert stock["mjsim"] is False
    assert stock["sizes"] == {name: getattr(model, name) for name in stock["sizes"]}
    assert stock["names"] == [model.body(i).name for i in range(model.nbody)]
    assert (stock["sleep"], stock["step"]) == (True, model.opt.timestep)
    np.testing.assert_allclose(stock["qpos0"], model.qpos0, rtol=0, atol=1e-12)
    mujoco.mj_step(model, data)
    np.testing.assert_allclose(stock["qpos"], data.qpos, rtol=0, atol=5e-5)


def _contact_rules(model):
    columns = (model.geom_bodyid, model.geom_type, model.geom_condim, model.geom_contype, model.geom_group)
    return sorted(tuple(int(v) for v in row) for row in np.stack(columns, axis=1))


def test_physics_stays_close_for_a_second(exported, scene):
    """MuJoCo writes six digits of masses and shapes, so equality ends there; behaviour does not."""
    copy = mujoco.MjModel.from_xml_path(str(exported))
    a, b = mujoco.MjData(scene.model), mujoco.MjData(copy)
    mujoco.mj_step(scene.model, a, nstep=250)
    mujoco.mj_step(copy, b, nstep=250)
    there, _ = scene.index.poses(a.qpos)
    here, _ = scene.index.poses(b.qpos)
    assert np.abs(there - here).max() < 0.002
    np.testing.assert_allclose(copy.body_mass, scene.model.body_mass, rtol=1e-4, atol=1e-9)
    # The static bodies are fused into one, so that reading them anew changes the order of its geoms.
    assert _contact_rules(copy) == _contact_rules(scene.model)
    np.testing.assert_array_equal(copy.eq_active0, scene.model.eq_active0)


def test_assets_are_all_there_and_no_more(exported):
    folder = exported.parent
    root = ET.parse(exported).getroot()
    named = {
        value
        for asset in root.iterfind("asset/*")
        for key, value in asset.attrib.items()
        if key.startswith("file")
    }
    assert named == {p.relative_to(folder).as_posix() for p in (folder / "assets").iterdir()}
    assert {p.name for p in folder.iterdir()} <= {"house.xml", "assets"}


def test_exporting_again_changes_nothing(exported, scene):
    before = {p: p.read_bytes() for p in exported.parent.rglob("*") if p.is_file()}
    export_house(scene, exported)
    assert {p: p.read_bytes() for p in exported.parent.rglob("*") if p.is_file()} == before


def test_house_without_person(episode, catalogue, tmp_path):
    bare = compose(episode, catalogue, avatar=False)
    export_house(bare, tmp_path / "bare.xml")
    copy = mujoco.MjModel.from_xml_path(str(tmp_path / "bare.xml"))
    np.testing.assert_allclose(copy.qpos0, bare.model.qpos0, rtol=0, atol=1e-12)


def test_other_endings_are_refused(scene, tmp_path):
    with pytest.raises(AssetError, match=r"house\.mjb"):
        export_house(scene, tmp_path / "house.mjb")
    assert list(tmp_path.iterdir()) == []


def _with_mesh_files(small_house, folder):
    """The small house with its wedge and its ball drawn by two files of the same name."""
    for file in small_house.iterdir():
        text = file.read_text(encoding="utf-8").replace(str(small_house), str(folder))
        (folder / file.name).write_text(text, encoding="utf-8")
    for name, top in (("wedge", 0.1), ("ball", 0.2)):
        (folder / name).mkdir()
        corners = f"v -.06 -.05 0\nv .06 -.05 0\nv 0 .05 0\nv 0 0 {top}\n"
        faces = "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
        (folder / name / "part.obj").write_text(corners + faces, encoding="utf-8")
        (folder / f"{name}.xml").write_text(
            f"""<mujoco><compiler meshdir="{name}"/><asset><mesh name="part" file="part.obj"/></asset>
            <worldbody><body name="object"><geom type="mesh" mesh="part" mass="0.2"/>
            <site name="grip_0" pos="0 0 {top}"/><site name="grip_1" pos="0 0 {top}" quat="0 0 0 1"/>
            </body></worldbody></mujoco>""",
            encoding="utf-8",
        )
    return Catalogue.load(str(folder / "catalogue.toml"))


def test_files_of_the_same_name_are_kept_apart(small_house, tmp_path):
    (tmp_path / "source").mkdir()
    catalogue = _with_mesh_files(small_house, tmp_path / "source")
    scene = scene_of(catalogue, START, ("wedge", 1, 1), ("ball", 2, 1))
    export_house(scene, tmp_path / "house.xml")
    shutil.rmtree(tmp_path / "source")
    copy = mujoco.MjModel.from_xml_path(str(tmp_path / "house.xml"))
    names = {copy.mesh(i).name for i in range(copy.nmesh)}
    assert len(names - {avatar.TRUNK, avatar.FOOT}) == 2
    np.testing.assert_allclose(copy.body_mass, scene.model.body_mass, rtol=1e-4)


def test_lost_asset_is_named_and_leaves_no_house(small_house, tmp_path):
    (tmp_path / "source").mkdir()
    catalogue = _with_mesh_files(small_house, tmp_path / "source")
    scene = scene_of(catalogue, START, ("wedge", 1, 1))
    (tmp_path / "source" / "wedge" / "part.obj").unlink()
    with pytest.raises(AssetError, match=r"wedge/part\.obj"):
        export_house(scene, tmp_path / "lost" / "house.xml")
    assert not (tmp_path / "lost" / "house.xml").exists()
