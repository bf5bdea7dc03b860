"""An exported house is plain MJCF: stock MuJoCo opens it from anywhere, and it moves like the original."""

import json
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import mujoco
import numpy as np
import pytest

from mjsim.catalogue import Catalogue
from mjsim.episode import Episode
from mjsim.errors import AssetError
from mjsim.export import export_house
from mjsim.scene import Scene, compose

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
def exported(scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("export") / "first" / "house.xml"
    export_house(scene, path)
    return path


def test_stock_mujoco_opens_it_from_another_folder(exported: Path, scene: Scene, tmp_path: Path) -> None:
    """After moving the folder as well: nothing refers to where it was written."""
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


def test_physics_stays_close_for_a_second(exported: Path, scene: Scene) -> None:
    """MuJoCo writes six digits of masses and shapes, so equality ends there; behaviour does not."""
    copy = mujoco.MjModel.from_xml_path(str(exported))
    a, b = mujoco.MjData(scene.model), mujoco.MjData(copy)
    mujoco.mj_step(scene.model, a, nstep=250)
    mujoco.mj_step(copy, b, nstep=250)
    there, _ = scene.index.poses(a.qpos)
    here, _ = scene.index.poses(b.qpos)
    assert np.abs(there - here).max() < 0.002
    np.testing.assert_allclose(copy.body_mass, scene.model.body_mass, rtol=1e-4, atol=1e-9)
    np.testing.assert_array_equal(copy.geom_condim, scene.model.geom_condim)
    np.testing.assert_array_equal(copy.geom_contype, scene.model.geom_contype)
    np.testing.assert_array_equal(copy.geom_group, scene.model.geom_group)
    np.testing.assert_array_equal(copy.eq_active0, scene.model.eq_active0)


def test_assets_are_all_there_and_no_more(exported: Path) -> None:
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


def test_exporting_again_changes_nothing(exported: Path, scene: Scene) -> None:
    before = {p: p.read_bytes() for p in exported.parent.rglob("*") if p.is_file()}
    export_house(scene, exported)
    assert {p: p.read_bytes() for p in exported.parent.rglob("*") if p.is_file()} == before


def test_house_without_person(episode: Episode, catalogue: Catalogue, tmp_path: Path) -> None:
    bare = compose(episode, catalogue, avatar=False)
    export_house(bare, tmp_path / "bare.xml")
    copy = mujoco.MjModel.from_xml_path(str(tmp_path / "bare.xml"))
    np.testing.assert_allclose(copy.qpos0, bare.model.qpos0, rtol=0, atol=1e-12)


def test_other_endings_are_refused(scene: Scene, tmp_path: Path) -> None:
    with pytest.raises(AssetError, match=r"house\.mjb"):
        export_house(scene, tmp_path / "house.mjb")
    assert list(tmp_path.iterdir()) == []


def test_lost_asset_is_named_and_leaves_no_house(small_house: Path, tmp_path: Path) -> None:
    """An asset file that vanished between composing and exporting."""
    source = tmp_path / "source"
    shutil.copytree(small_house, source)
    for file in source.iterdir():
        file.write_text(
            file.read_text(encoding="utf-8").replace(str(small_house), str(source)), encoding="utf-8"
        )
    mesh = source / "wedge.obj"
    mesh.write_text(
        "v 0 0 0\nv .1 0 0\nv 0 .1 0\nv 0 0 .1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n", encoding="utf-8"
    )
    wedge = source / "wedge.xml"
    root = ET.parse(wedge).getroot()
    asset = root.find("asset/mesh")
    assert asset is not None
    asset.attrib = {"name": "wedge", "file": "wedge.obj"}
    ET.ElementTree(root).write(wedge)
    catalogue = Catalogue.load(str(source / "catalogue.toml"))
    placed = _on_the_floor(catalogue, "wedge")
    composed = compose(placed, catalogue)
    export_house(composed, tmp_path / "whole" / "house.xml")
    assert [p.suffix for p in (tmp_path / "whole" / "assets").iterdir()] == [".obj"]
    mesh.unlink()
    with pytest.raises(AssetError, match=r"wedge\.obj"):
        export_house(composed, tmp_path / "lost" / "house.xml")
    assert not (tmp_path / "lost" / "house.xml").exists()


def _on_the_floor(catalogue: Catalogue, model: str) -> Episode:
    raw = {
        "format": 1, "house": catalogue.name, "seed": 0, "start": {"x": 1.5, "y": 1.5, "heading": 0.0},
        "objects": [{"name": "object_00", "category": catalogue.objects[model].category, "model": model,
                     "point": [1, 1], "position": [1, 1, 0], "quaternion": [1, 0, 0, 0]}],
        "receptacles": list(catalogue.receptacles),
        "targets": {"object_00": catalogue.receptacle_of(model).key},
    }  # fmt: skip
    return Episode.from_json(json.dumps(raw))
