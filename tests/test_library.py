"""Models as they are read: looks apart from what collides, and every file read once."""

import copy
import pickle
from pathlib import Path

import mujoco
import numpy as np
import pytest

from mjsim.episode import Episode
from mjsim.errors import AssetError
from mjsim.model import library
from mjsim.model.catalogue import Catalogue
from mjsim.model.library import LOOKS, Library
from mjsim.model.scene import compile_house, compose
from mjsim.world_state import model_fingerprint

_OBJECT = """
<mujoco>
  <compiler angle="degree"/>
  <default>
    <default class="look"><geom group="2" contype="0" conaffinity="0" mass="0"/></default>
  </default>
  <worldbody>
    <body name="object">
      <geom name="hull" type="box" size="0.05 0.04 0.03" pos="0 0 0.03" mass="0.2"/>
      <geom name="loose" class="look" type="sphere" size="0.01" pos="0.1 0 0"/>
      <frame pos="0 0.1 0" euler="0 0 90">
        <geom name="framed" class="look" type="box" size="0.03 0.02 0.01" pos="0.05 0 0" quat="0.6 0.8 0 0"/>
        <geom name="guard" type="sphere" size="0.02" pos="0.05 0 0" mass="0.1"/>
        <frame axisangle="1 0 0 30">
          <geom name="nested" class="look" type="box" size="0.03 0.02 0.01" pos="0.02 0 0"/>
        </frame>
      </frame>
      <geom name="ballast" group="2" contype="0" conaffinity="0" type="sphere" size="0.01" mass="0.05"/>
      <site name="grip_0"/>
      <site name="grip_1"/>
    </body>
  </worldbody>
</mujoco>
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "thing.xml"
    path.write_text(_OBJECT, encoding="utf-8")
    return path


def _geoms(spec: mujoco.MjSpec) -> dict[str, tuple[str, list[float]]]:
    """Body and pose in the object's frame, by name of geom."""
    spec.body("object").add_freejoint()
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return {
        model.geom(g).name: (
            model.body(model.geom_bodyid[g]).name,
            np.round(np.concatenate([data.geom_xpos[g], data.geom_xmat[g], model.geom_size[g]]), 9).tolist(),
        )
        for g in range(model.ngeom)
    }


def test_what_only_looks_has_a_body_of_its_own_and_stays_where_it_is(path: Path) -> None:
    whole = _geoms(mujoco.MjSpec.from_file(str(path)))
    apart = _geoms(Library().object_model(path))
    assert {name: pose for name, (_, pose) in apart.items()} == {n: pose for n, (_, pose) in whole.items()}
    moved = {name for name, (body, _) in apart.items() if body == LOOKS}
    assert moved == {"loose", "framed"}  # what has mass belongs to the object's inertia
    assert {body for body, _ in whole.values()} == {"object"}


def test_objects_of_a_scene_weigh_what_their_files_say(catalogue: Catalogue, episode: Episode) -> None:
    scene = compose(episode, catalogue)
    for name, body, placed in zip(scene.index.names, scene.index.bodies, episode.objects, strict=True):
        alone = mujoco.MjModel.from_xml_path(str(catalogue.objects[placed.model].path))
        looks = scene.model.body(f"{name}/{LOOKS}")
        assert scene.model.body_mass[body] == pytest.approx(alone.body_subtreemass[0], rel=1e-12)
        assert looks.mass == 0 and looks.rootid == body
        # The broad phase is left with what collides.
        geoms = np.flatnonzero(scene.model.geom_bodyid == body)
        assert (scene.model.geom_contype[geoms] | scene.model.geom_conaffinity[geoms]).all()


def test_files_are_read_once_and_models_do_not_change(
    small_house: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    read: list[str] = []
    original = library.read_model
    monkeypatch.setattr(
        "mjsim.model.scene.read_model", lambda p, **kw: (read.append(str(p)), original(p, **kw))[1]
    )
    monkeypatch.setattr(library, "read_model", lambda p, **kw: (read.append(str(p)), original(p, **kw))[1])
    catalogue = Catalogue.load(str(small_house / "catalogue.toml"))
    first, second = compile_house(catalogue), compile_house(catalogue)
    assert len(read) == len(set(read)) == 3  # the house and two receptacles
    fresh = compile_house(Catalogue.load(str(small_house / "catalogue.toml")))
    assert model_fingerprint(first) == model_fingerprint(second) == model_fingerprint(fresh)


def test_a_scene_composed_from_kept_models_is_the_same(catalogue: Catalogue, episode: Episode) -> None:
    kept = [model_fingerprint(compose(episode, catalogue).model) for _ in range(2)]
    fresh = model_fingerprint(compose(episode, Catalogue.load(catalogue.name)).model)
    assert kept == [fresh, fresh]


def test_a_catalogue_travels_without_its_models(catalogue: Catalogue) -> None:
    compile_house(catalogue)
    for other in (copy.deepcopy(catalogue), pickle.loads(pickle.dumps(catalogue))):
        assert other == catalogue
        assert compile_house(other).nbody == compile_house(catalogue).nbody


def test_a_failed_reading_is_not_kept(tmp_path: Path) -> None:
    kept, path = Library(), tmp_path / "thing.xml"
    with pytest.raises(AssetError, match=r"cannot read model .*thing\.xml"):
        kept.object_model(path)
    path.write_text(_OBJECT, encoding="utf-8")
    assert kept.object_model(path).body("object") is not None
