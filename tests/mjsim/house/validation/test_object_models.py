"""Objects and receptacles as authored: they keep the conventions, rest stably, and bins hold them."""

import cv2
import mujoco
import numpy as np
import pytest
from small_worlds import FLOOR, dropped, loose

from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.catalogue.house_ref import models_root
from mjsim.house.validation.object_rules import check_object
from mjsim.house.validation.receptacle_rules import check_receptacle
from tools.authoring.objects import build_meshes

CATALOGUE = Catalogue.load()
SLOTS = [(-0.5, 0.5), (0.5, 0.5), (-0.5, -0.5), (0.5, -0.5)]


@pytest.fixture(params=list(CATALOGUE.objects))
def key(request):
    return str(request.param)


@pytest.fixture(params=list(CATALOGUE.receptacles))
def bin_key(request):
    return str(request.param)


def test_every_model_keeps_the_conventions():
    """Those of docs/models.md; test_object_rules.py shows that each of them is checked."""
    objects = [finding for key, item in CATALOGUE.objects.items() for finding in check_object(item.path, key)]
    bins = [f for key, item in CATALOGUE.receptacles.items() for f in check_receptacle(item.path, key)]
    assert objects + bins == []


def test_meshes_stay_cheap_to_draw_and_collide_in_few_parts():
    for item in CATALOGUE.objects.values():
        model = mujoco.MjModel.from_xml_path(str(item.path))
        assert np.all(model.mesh_facenum < 1500) and model.mesh_facenum.sum() < 2500, item.key
        assert 1 <= np.count_nonzero(model.geom_contype) <= 6, item.key


def test_a_dropped_object_comes_to_rest_upright_and_stays(key):
    data = dropped(CATALOGUE.objects[key].path, 0.05)
    for _ in range(250):
        mujoco.mj_step(data.model, data)
        assert np.linalg.norm(data.qvel[:3]) < 0.02
    assert data.body("it/object").xmat[8] > 0.99  # the body's z axis is still vertical
    assert np.linalg.norm(data.qpos[:2]) < 0.02
    assert abs(data.qpos[2]) < 0.002


@pytest.mark.parametrize("axis", [0, 1])
def test_a_toppled_object_that_gets_a_push_stops(key, axis):
    spec = mujoco.MjSpec.from_string(FLOOR)
    loose(spec, CATALOGUE.objects[key].path, "it")
    model = spec.compile()
    data = mujoco.MjData(model)
    quarter = np.zeros(4)
    quarter[[0, 1 + axis]] = np.sqrt(0.5)
    data.qpos[2:7] = [0.2, *quarter]
    mujoco.mj_step(model, data, 200)
    data.qvel[:2] += [0.5 * axis, 0.5 * (1 - axis)]  # across its length, the way it would roll
    start = data.qpos[:2].copy()
    mujoco.mj_step(model, data, 1250)  # 5 s
    assert np.linalg.norm(data.qvel[:3]) < 0.02
    assert np.linalg.norm(data.qpos[:2] - start) < 0.6


def filled(bin_key, objects):
    """Set objects down slot by slot; yield position and speed of each at the end, in the volume's frame."""
    spec = mujoco.MjSpec.from_string(FLOOR)
    child = mujoco.MjSpec.from_file(str(CATALOGUE.receptacles[bin_key].path))
    spec.worldbody.add_frame().attach_body(child.body("receptacle"), "bin/", "")
    for k, path in enumerate(objects):
        loose(spec, path, f"{k}")
    model = spec.compile()
    data = mujoco.MjData(model)
    for k in range(len(objects)):
        data.qpos[7 * k] = 2.0 + k  # wait aside
    volume = model.site("bin/volume")
    for k, (x, y) in enumerate(SLOTS[: len(objects)]):
        start = 7 * k
        data.qvel[6 * k : 6 * k + 6] = 0
        place = volume.pos + np.array([x, y, -1]) * volume.size + np.array([0, 0, 0.003])
        data.qpos[start : start + 7] = [*place, np.sqrt(0.5), 0, 0, np.sqrt(0.5)]
        while overlap(model, data, k) > 0.001:
            data.qpos[start + 2] += 0.005
        mujoco.mj_step(model, data, 250)
    mujoco.mj_step(model, data, 500)
    for k in range(len(objects)):
        offset = (data.body(f"{k}/object").xpos - volume.pos) / (volume.size + 0.005)
        yield offset, data.qvel[6 * k : 6 * k + 3]


def overlap(model, data, k):
    mujoco.mj_fwdPosition(model, data)
    body = model.body(f"{k}/object").id
    owners = model.geom_bodyid[data.contact.geom]
    return float(-np.min(data.contact.dist[np.any(owners == body, axis=1)], initial=0.0))


def test_a_small_box_stays_in_each_slot(bin_key, tmp_path):
    path = tmp_path / "block.xml"
    path.write_text(
        '<mujoco><worldbody><body name="object"><geom type="box" size=".03 .03 .03" pos="0 0 .03" mass=".2"/>'
        "</body></worldbody></mujoco>",
        encoding="utf-8",
    )
    for (x, y), (offset, velocity) in zip(SLOTS, filled(bin_key, [path] * 4), strict=True):
        assert np.all(np.abs(offset) <= 1)
        assert np.allclose(offset[:2], [x, y], atol=0.1)
        assert np.linalg.norm(velocity) < 0.05


@pytest.mark.parametrize("first", range(3))
def test_a_receptacle_holds_four_objects_of_its_category(bin_key, first):
    keys = CATALOGUE.categories[CATALOGUE.receptacles[bin_key].category].objects
    chosen = [CATALOGUE.objects[keys[(2 * first + k) % len(keys)]].path for k in range(4)]
    for path, (offset, velocity) in zip(chosen, filled(bin_key, chosen), strict=True):
        assert np.all(np.abs(offset) <= 1), path.stem
        assert np.linalg.norm(velocity) < 0.05, path.stem


def numbers(path, kind):
    lines = (line.split() for line in path.read_text(encoding="utf-8").splitlines())
    rows = [row[1:] for row in lines if row[0] == kind]
    return np.array([[float(x) for x in row] for row in rows])


@pytest.mark.slow
def test_committed_meshes_and_labels_are_what_the_generator_makes(tmp_path):
    first, second = build_meshes(tmp_path / "first"), build_meshes(tmp_path / "second")
    assert [p.read_bytes() for p in first] == [p.read_bytes() for p in second]
    made = {p.relative_to(tmp_path / "first") for p in first}
    root = models_root()
    there = {p.relative_to(root) for f in ("objects", "receptacles") for p in (root / f).glob("*/*.*")}
    assert made == there
    for name in sorted(made):
        ours, committed = tmp_path / "first" / name, root / name
        if name.suffix == ".png":
            images = [cv2.imread(str(p)).astype(int) for p in (ours, committed)]
            assert images[0].shape == images[1].shape
            assert np.abs(images[0] - images[1]).mean() < 2.0, name
        else:
            # Another version of a library may order faces otherwise, but not move the surface.
            mine, theirs = numbers(ours, "v"), numbers(committed, "v")
            faces = [
                sum(line.startswith("f ") for line in p.read_text("utf-8").splitlines())
                for p in (ours, committed)
            ]
            assert faces[0] == faces[1], name
            assert np.allclose(np.sort(mine, axis=0), np.sort(theirs, axis=0), atol=3e-5), name
    assert sum((root / name).stat().st_size for name in made) < 3_000_000


def test_every_generated_file_is_used_by_a_model():
    root = models_root()
    for folder in ("objects", "receptacles"):
        text = "".join(p.read_text(encoding="utf-8") for p in (root / folder).glob("*.xml"))
        for path in (root / folder).glob("*/*.*"):
            assert f'file="{path.name}"' in text, path.name
