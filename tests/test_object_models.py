"""Objects and receptacles as authored: they compile alone, have real sizes, rest stably, and bins hold them."""

from collections.abc import Iterator
from pathlib import Path

import cv2
import mujoco
import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from authoring.objects import build_meshes
from mjsim.model.assets import models_root
from mjsim.model.catalogue import Catalogue

CATALOGUE = Catalogue.load()
FLOOR = """<mujoco><option timestep="0.004" integrator="implicitfast" cone="elliptic" impratio="10"/>
<worldbody><geom name="ground" type="plane" size="5 5 1"/></worldbody></mujoco>"""
SLOTS = [(-0.5, 0.5), (0.5, 0.5), (-0.5, -0.5), (0.5, -0.5)]
LOOK, GUARD = 2, 3  # geom groups of docs/models.md
Floats = NDArray[np.float64]


@pytest.fixture(params=list(CATALOGUE.objects))
def key(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(params=list(CATALOGUE.receptacles))
def bin_key(request: pytest.FixtureRequest) -> str:
    return str(request.param)


def alone(path: Path) -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def loose(spec: mujoco.MjSpec, path: Path, name: str, height: float = 0.0) -> None:
    """Attach the object of a file with a free joint, the way a scene does."""
    child = mujoco.MjSpec.from_file(str(path))
    body = spec.worldbody.add_frame(pos=[0, 0, height]).attach_body(child.body("object"), f"{name}/", "")
    body.add_freejoint(name=f"{name}/free")


def surface_points(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> Floats:
    """Points on a geom whose bounding box is that of the geom, worked out per type, shape (n, 3)."""
    size, kind = model.geom_size[geom], mujoco.mjtGeom(model.geom_type[geom])
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = model.geom_dataid[geom]
        first = model.mesh_vertadr[mesh]
        local = model.mesh_vert[first : first + model.mesh_vertnum[mesh]].astype(float)
    elif kind == mujoco.mjtGeom.mjGEOM_BOX:
        local = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]) * size
    else:
        a = np.linspace(0, 2 * np.pi, 49)
        ring = np.column_stack([np.cos(a), np.sin(a)])
        if kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
            local = np.vstack([np.column_stack([ring * size[0], np.full(49, z * size[1])]) for z in (-1, 1)])
        else:
            radii = np.repeat(size[:1], 3) if kind == mujoco.mjtGeom.mjGEOM_SPHERE else size
            t = np.linspace(-np.pi / 2, np.pi / 2, 25)[:, None, None]
            unit = np.concatenate([np.cos(t) * ring, np.broadcast_to(np.sin(t), (25, 49, 1))], axis=2)
            local = unit.reshape(-1, 3) * radii
    return local @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]


def extent(model: mujoco.MjModel, data: mujoco.MjData, *, collides: bool) -> Floats:
    """Lower and upper corner of what collides, or of what is only seen, shape (2, 3)."""
    geoms = [g for g in range(model.ngeom) if bool(model.geom_contype[g]) == collides]
    points = np.vstack([surface_points(model, data, g) for g in geoms])
    return np.array([points.min(axis=0), points.max(axis=0)])


def test_an_object_is_one_jointless_body_with_looks_that_weigh_nothing(key: str) -> None:
    model, _ = alone(CATALOGUE.objects[key].path)
    spec = mujoco.MjSpec.from_file(str(CATALOGUE.objects[key].path))
    assert (model.nbody, model.njnt, model.body(1).name) == (2, 0, "object")
    assert 0.03 <= model.body_mass[1] <= 1.5
    looks = [g for g in spec.geoms if g.contype == 0 and g.conaffinity == 0]
    parts = [g for g in spec.geoms if g.contype and g.conaffinity]
    assert len(looks) + len(parts) == model.ngeom
    assert all(g.group == LOOK and g.mass == 0 for g in looks)
    assert all(g.group in (0, GUARD) and g.mass > 0 and g.condim >= 4 for g in parts)
    assert 1 <= len(parts) <= 6
    assert len(looks) <= 15


def test_an_object_has_a_real_size_and_looks_where_it_collides(key: str) -> None:
    model, data = alone(CATALOGUE.objects[key].path)
    solid, seen = extent(model, data, collides=True), extent(model, data, collides=False)
    for box in (solid, seen):
        assert 0.06 <= np.max(box[1] - box[0]) <= 0.32
    assert np.min(solid[1] - solid[0]) >= 0.015
    assert abs(solid[0, 2]) < 1e-6  # it rests at z = 0 of its own frame
    assert np.all(np.abs(solid.mean(axis=0)[:2]) < 0.012)  # origin at the footprint's centre
    assert np.all(np.abs(solid - seen) < 0.022)
    assert seen[0, 2] > -0.002  # nothing shows below the floor


def test_collision_parts_are_convex_and_not_thin(key: str) -> None:
    model, data = alone(CATALOGUE.objects[key].path)
    kinds = mujoco.mjtGeom
    for geom in np.flatnonzero(model.geom_contype):
        points = surface_points(model, data, geom)
        kind = mujoco.mjtGeom(model.geom_type[geom])
        if kind == kinds.mjGEOM_MESH:
            mesh = model.geom_dataid[geom]
            first, count = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
            solid = trimesh.Trimesh(points, model.mesh_face[first : first + count])
            assert solid.volume > 0.97 * solid.convex_hull.volume
        else:
            convex = (kinds.mjGEOM_BOX, kinds.mjGEOM_CYLINDER, kinds.mjGEOM_SPHERE, kinds.mjGEOM_CAPSULE)
            assert kind in (*convex, kinds.mjGEOM_ELLIPSOID)
        local = (points - data.geom_xpos[geom]) @ data.geom_xmat[geom].reshape(3, 3)
        assert np.min(np.ptp(local, axis=0)) >= 0.015


def test_meshes_stay_cheap_to_draw(key: str) -> None:
    model, _ = alone(CATALOGUE.objects[key].path)
    assert np.all(model.mesh_facenum < 1500)
    assert model.mesh_facenum.sum() < 2500


def test_grips_sit_on_top_about_the_vertical_axis(key: str) -> None:
    model, data = alone(CATALOGUE.objects[key].path)
    top = extent(model, data, collides=True)[1, 2]
    frames = [data.site(name).xmat.reshape(3, 3) for name in ("grip_0", "grip_1")]
    for name, frame in zip(("grip_0", "grip_1"), frames, strict=True):
        position = data.site(name).xpos
        assert np.hypot(*position[:2]) < 0.02
        assert abs(position[2] - top) < 0.012
        assert frame[2, 2] == pytest.approx(1.0)
    assert frames[0][:, 0] @ frames[1][:, 0] == pytest.approx(-1.0)
    assert model.nsite == 2


def test_a_dropped_object_comes_to_rest_upright_and_stays(key: str) -> None:
    spec = mujoco.MjSpec.from_string(FLOOR)
    loose(spec, CATALOGUE.objects[key].path, "it", height=0.05)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 750)  # 3 s
    for _ in range(250):
        mujoco.mj_step(model, data)
        assert np.linalg.norm(data.qvel[:3]) < 0.02
    assert data.body("it/object").xmat[8] > 0.99  # the body's z axis is still vertical
    assert np.linalg.norm(data.qpos[:2]) < 0.02
    assert abs(data.qpos[2]) < 0.002


@pytest.mark.parametrize("axis", [0, 1])
def test_a_toppled_object_that_gets_a_push_stops(key: str, axis: int) -> None:
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


def test_the_same_object_fits_twice_into_a_scene_from_another_folder(tmp_path: Path, key: str) -> None:
    (tmp_path / "house.xml").write_text(FLOOR, encoding="utf-8")
    spec = mujoco.MjSpec.from_file(str(tmp_path / "house.xml"))
    for name in ("first", "second"):
        loose(spec, CATALOGUE.objects[key].path, name)
    model = spec.compile()
    assert model.nbody == 3
    assert model.body("first/object").mass == model.body("second/object").mass


def test_a_receptacle_is_one_jointless_body_with_firm_contacts(bin_key: str) -> None:
    model, _ = alone(CATALOGUE.receptacles[bin_key].path)
    assert (model.nbody, model.njnt, model.body(1).name) == (2, 0, "receptacle")
    solid = np.flatnonzero(model.geom_contype)
    assert np.all(model.geom_condim[solid] == 6)
    assert np.allclose(model.geom_solref[solid], [0.008, 1.0])
    assert np.all(np.isin(model.geom_group[solid], (0, GUARD)))
    assert np.all(model.geom_group[model.geom_contype == 0] == LOOK)


def ray(model: mujoco.MjModel, data: mujoco.MjData, origin: Floats, direction: Floats) -> tuple[float, int]:
    """Distance to, and id of, the first colliding geom; -1 for none."""
    groups = np.array([1, 0, 0, 1, 0, 0], np.uint8)
    hit = np.array([-1], np.int32)
    return mujoco.mj_ray(model, data, origin, direction, groups, 1, -1, hit), int(hit[0])


def test_the_volume_is_the_interior_and_the_floor_is_40_mm_thick(bin_key: str) -> None:
    model, data = alone(CATALOGUE.receptacles[bin_key].path)
    volume = model.site("volume")
    center, half = volume.pos, volume.size
    bottom, rim = center[2] - half[2], extent(model, data, collides=True)[1, 2]
    assert 0.1 <= rim - bottom <= 0.35
    assert 0.02 <= center[2] + half[2] - rim <= 0.0601  # a little of a heap
    for x, y in SLOTS:
        above = np.array([center[0] + x * half[0], center[1] + y * half[1], rim + 0.3])
        distance, floor = ray(model, data, above, np.array([0.0, 0.0, -1.0]))
        assert above[2] - distance == pytest.approx(bottom, abs=1e-4)
        assert 2 * model.geom_size[floor, 2] == pytest.approx(0.04)
    for axis, sign in ((0, 1), (0, -1), (1, 1), (1, -1)):
        outwards = np.zeros(3)
        outwards[axis] = sign
        for height in (bottom + 0.01, rim - 0.01):  # a wall from the floor to the rim
            distance, wall = ray(model, data, np.array([*center[:2], height]), outwards)
            assert distance == pytest.approx(half[axis], abs=1e-4)
            points = surface_points(model, data, wall)
            assert 0.014 <= np.ptp(points[:, axis]) <= 0.021
        assert ray(model, data, np.array([*center[:2], rim + 0.01]), outwards)[1] == -1


def test_the_approach_leaves_room_for_a_person_in_front(bin_key: str) -> None:
    model, data = alone(CATALOGUE.receptacles[bin_key].path)
    approach = model.site("approach").pos
    front = extent(model, data, collides=True)[0, 1]
    assert approach[0] == 0.0
    assert 0.3 <= front - approach[1] <= 0.6


def filled(bin_key: str, objects: list[Path]) -> Iterator[tuple[Floats, Floats]]:
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


def overlap(model: mujoco.MjModel, data: mujoco.MjData, k: int) -> float:
    mujoco.mj_fwdPosition(model, data)
    body = model.body(f"{k}/object").id
    owners = model.geom_bodyid[data.contact.geom]
    return float(-np.min(data.contact.dist[np.any(owners == body, axis=1)], initial=0.0))


def test_a_small_box_stays_in_each_slot(bin_key: str, tmp_path: Path) -> None:
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
def test_a_receptacle_holds_four_objects_of_its_category(bin_key: str, first: int) -> None:
    keys = CATALOGUE.categories[CATALOGUE.receptacles[bin_key].category].objects
    chosen = [CATALOGUE.objects[keys[(2 * first + k) % len(keys)]].path for k in range(4)]
    for path, (offset, velocity) in zip(chosen, filled(bin_key, chosen), strict=True):
        assert np.all(np.abs(offset) <= 1), path.stem
        assert np.linalg.norm(velocity) < 0.05, path.stem


def numbers(path: Path, kind: str) -> Floats:
    lines = (line.split() for line in path.read_text(encoding="utf-8").splitlines())
    rows = [row[1:] for row in lines if row[0] == kind]
    return np.array([[float(x) for x in row] for row in rows])


def test_committed_meshes_and_labels_are_what_the_generator_makes(tmp_path: Path) -> None:
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
            assert len(numbers_of_faces(ours)) == len(numbers_of_faces(committed)), name
            assert np.allclose(np.sort(mine, axis=0), np.sort(theirs, axis=0), atol=3e-5), name
    assert sum((root / name).stat().st_size for name in made) < 3_000_000


def numbers_of_faces(path: Path) -> list[str]:
    return [line for line in path.read_text(encoding="utf-8").splitlines() if line.startswith("f ")]


def test_every_generated_file_is_used_by_a_model() -> None:
    root = models_root()
    for folder in ("objects", "receptacles"):
        text = "".join(p.read_text(encoding="utf-8") for p in (root / folder).glob("*.xml"))
        for path in (root / folder).glob("*/*.*"):
            assert f'file="{path.name}"' in text, path.name
