"""A house is read and compiled once per content; visuals of objects are apart from what collides."""

import copy
import math
import pickle
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from experiments.house import House
from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.catalogue.model_files import content_hash, read_model
from mjsim.house.compiled import house
from mjsim.house.compiled.house import VISUAL_BODY, compiled_house, separate_visuals
from mjsim.house.scene.scene import compose
from mjsim.house.sight.drawn_state import drawn_state
from mjsim.house.sight.sight import visible_objects
from mjsim.values.actions import Move, Pick
from mjsim.values.errors import AssetError
from mjsim.world.state import model_fingerprint
from mjsim.world.world import World

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
def path(tmp_path):
    path = tmp_path / "thing.xml"
    path.write_text(_OBJECT, encoding="utf-8")
    return path


def _geoms(spec):
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


def test_what_only_looks_has_a_body_of_its_own_and_stays_where_it_is(path):
    whole = _geoms(mujoco.MjSpec.from_file(str(path)))
    apart = _geoms(separate_visuals(read_model(path, body="object")))
    assert {name: pose for name, (_, pose) in apart.items()} == {n: pose for n, (_, pose) in whole.items()}
    moved = {name for name, (body, _) in apart.items() if body == VISUAL_BODY}
    assert moved == {"loose", "framed"}  # what has mass belongs to the object's inertia
    assert {body for body, _ in whole.values()} == {"object"}


def test_objects_of_a_scene_weigh_what_their_files_say(catalogue, episode):
    scene = compose(episode, catalogue)
    for name, body, placed in zip(scene.index.names, scene.index.bodies, episode.objects, strict=True):
        alone = mujoco.MjModel.from_xml_path(str(catalogue.objects[placed.model].path))
        looks = scene.model.body(f"{name}/{VISUAL_BODY}")
        assert scene.model.body_mass[body] == pytest.approx(alone.body_subtreemass[0], rel=1e-12)
        assert looks.mass == 0 and looks.rootid == body
        # The broad phase is left with what collides.
        geoms = np.flatnonzero(scene.model.geom_bodyid == body)
        assert (scene.model.geom_contype[geoms] | scene.model.geom_conaffinity[geoms]).all()


def test_a_house_is_read_and_compiled_once_for_all_who_load_it(fresh_house, monkeypatch):
    read = []
    monkeypatch.setattr(house, "read_model", lambda p, **kw: (read.append(str(p)), read_model(p, **kw))[1])
    first, again = (compiled_house(Catalogue.load(str(fresh_house))) for _ in range(2))
    assert first is again and first.model is again.model
    assert len(read) == len(set(read)) == 3  # the house and two receptacles
    copied = [copy.deepcopy(first.catalogue), pickle.loads(pickle.dumps(first.catalogue))]
    assert all(other == first.catalogue and compiled_house(other) is first for other in copied)


@pytest.mark.parametrize("name", ["house.xml", "crate.xml", "cube.xml", "catalogue.toml"])
def test_a_file_that_changes_gives_a_new_model(fresh_house, name):
    before = Catalogue.load(str(fresh_house))
    changed = fresh_house.with_name(name)
    changed.write_text(changed.read_text() + ("\n# changed" if name.endswith("toml") else "<!-- changed -->"))
    after = Catalogue.load(str(fresh_house))
    assert after != before and compiled_house(after) is not compiled_house(before)


def test_included_files_meshes_and_textures_count_as_content(tmp_path):
    names = ("inner.xml", "meshes/shape.obj", "looks/wood.png")
    for name in names:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("<mujoco/>")
    outer = tmp_path / "outer.xml"
    outer.write_text(
        '<mujoco><compiler meshdir="meshes" texturedir="looks"/><include file="inner.xml"/><asset>'
        '<mesh file="shape.obj"/><texture fileright="wood.png"/><mesh file="missing.obj"/></asset></mujoco>'
    )
    hashes = {content_hash("", [outer])}
    for name in names:
        (tmp_path / name).write_text("<mujoco> </mujoco>")
        hashes.add(content_hash("", [outer]))
    assert len(hashes) == 4


def test_states_fit_a_scene_with_and_without_visuals_and_who_looks_sees_the_same(catalogue, episode):
    falling = replace(episode, objects=tuple(replace(o, position=(*o.point, 0.05)) for o in episode.objects))
    worlds = [World(compose(falling, catalogue, visuals=visuals)) for visuals in (True, False)]
    whole, lean = worlds[0].scene, worlds[1].scene
    assert lean.model.ngeom < whole.model.ngeom and lean.model.nbody == whole.model.nbody
    assert lean.counterpart(visuals=True).model.ngeom == whole.model.ngeom
    for step in range(200):
        action = Pick() if step == 20 else Move(forward=0.6, turn=0.8, look=-0.2)
        results = [world.step(action) for world in worlds]
        assert results[0].result == results[1].result
    assert worlds[0].state_hash() == worlds[1].state_hash()
    assert worlds[0].state().hash == worlds[1].state().hash
    _, drawn = drawn_state(lean, worlds[1].data)
    for name in ("xpos", "xmat", "xipos", "ximat", "geom_xpos", "geom_xmat"):
        assert getattr(drawn, name).tobytes() == getattr(worlds[0].data, name).tobytes(), name
    now = worlds[0].observation()
    seen = [
        visible_objects(world.scene, world.data, now.eye, heading, 0.0)
        for heading in np.linspace(-math.pi, math.pi, 12)
        for world in worlds
    ]
    assert seen[::2] == seen[1::2] and any(seen)
    assert len({model_fingerprint(s.counterpart(visuals=False).model) for s in (whole, lean)}) == 1


@pytest.mark.parametrize("name", ["house.xml", "crate.xml"])
def test_a_house_that_does_not_compile_says_which_and_why(fresh_house, name):
    broken = fresh_house.with_name(name)
    broken.write_text(broken.read_text().replace("</worldbody>", '<geom name="flat" size="0"/></worldbody>'))
    with pytest.raises(AssetError, match=rf"{name}.*does not compile: .*flat.*correct") as caught:
        House.load(str(fresh_house))
    assert "\n" not in str(caught.value)


def test_a_failed_reading_is_not_kept(fresh_house):
    shared, cube = compiled_house(Catalogue.load(str(fresh_house))), fresh_house.with_name("cube.xml")
    good = cube.read_text()
    cube.write_text("<mujoco>")
    with pytest.raises(AssetError, match=r"cannot read model .*cube\.xml"):
        shared.object_spec(cube)
    cube.write_text(good)
    assert shared.object_spec(cube).body("object") is not None
