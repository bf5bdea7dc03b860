"""`mjsim import`: mesh files of many kinds become objects that follow the conventions, or are refused in one line."""

import json
import os
import re
import signal
import time

import mujoco
import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from mesh_files import HOLLOW, MESHES, Y_UP, MeshFile, picture, plain, tetrahedron
from scipy.spatial import Delaunay
from small_worlds import dropped

from benchmarks.support.placement_sessions import arrange, run_episode
from experiments.cli import main as cli
from experiments.house import House
from mjsim.formats.scene.source_scene import ImportOptions
from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.compiled.house import compiled_house
from mjsim.house.validation.object_rules import check_object
from mjsim.importing.object import house_extension
from mjsim.importing.object.closed_body import weigh
from mjsim.importing.object.house_extension import CatalogueEntry, HouseExtension, held_in
from mjsim.importing.object.mesh_import import add_mesh
from mjsim.importing.object.object_import import import_object
from mjsim.importing.object.parts import MAX_PARTS, MAX_VERTICES, MIN_WIDTH, cuts_itself, narrowest
from mjsim.importing.object.resting import STEADY, resting_pose
from mjsim.importing.object.visual_mesh import SIDE, Atlas
from mjsim.support.files import remove_leftovers
from mjsim.values.errors import AssetError, RenderError
from mjsim.values.options import WorldOptions

MAKE = trimesh.creation
WRITE_PREVIEW = "mjsim.importing.object.mesh_import.write_preview"
pytestmark = pytest.mark.xdist_group("imported objects")


@pytest.fixture(scope="module")
def imported(tmp_path_factory):
    """The apartment with all mesh files imported, without their pictures, and the report of each."""
    folder = tmp_path_factory.mktemp("imported")
    reports = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(WRITE_PREVIEW, lambda *_: None)
        for name, mesh in MESHES.items():
            extension = HouseExtension(folder / "house")
            entry = CatalogueEntry.named(name, mesh.category)
            reports[name] = add_mesh(mesh.write(folder, name), extension, entry, mesh.options)
    return HouseExtension(folder / "house"), reports


@pytest.fixture(params=list(MESHES))
def key(request):
    return str(request.param)


def report(decisions, what):
    return next(f"{d.choice}: {d.reason}" for d in decisions if d.what == what)


def take(tmp_path, mesh, suffix=".stl", **options):
    """Import a mesh that is written to a file."""
    return import_object(MeshFile(suffix, lambda: mesh).write(tmp_path, "it"), ImportOptions(**options))


@pytest.mark.slow
def test_an_imported_object_keeps_the_conventions_of_ours(imported, key):
    path = imported[0].catalogue.objects[key].path
    assert check_object(path, key) == []
    model = mujoco.MjModel.from_xml_path(str(path))
    solid = np.flatnonzero(model.geom_contype)
    assert 1 <= len(solid) <= MAX_PARTS + 1
    assert model.ngeom - len(solid) == 1
    assert model.mesh_facenum.max() < 1500
    for geom in solid:
        mesh = model.geom_dataid[geom]
        first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        assert count <= MAX_VERTICES + 8
        assert narrowest(model.mesh_vert[first : first + count].astype(float))[1] > MIN_WIDTH - 1e-4


@pytest.mark.slow
def test_an_imported_object_rests_where_it_is_put(imported, key):
    data = dropped(imported[0].catalogue.objects[key].path, 0.02)
    assert data.body("it/object").xmat[8] > 0.98
    assert np.linalg.norm(data.qpos[:2]) < 0.02
    assert np.linalg.norm(data.qvel[:3]) < 0.02


@pytest.mark.slow
@pytest.mark.parametrize("tier", ["full", "event"])
@pytest.mark.parametrize(
    "name", ["long_stick", "cup", "many_parts", "truck", *(f"own_{name}" for name in HOLLOW)]
)
def test_imported_objects_are_carried_and_placed(imported, name, tier):
    house = House.load(str(imported[0].path))
    category = house.catalogue.categories[house.catalogue.objects[name].category]
    models = [name, name, *(k for k in category.objects if k not in MESHES)][:6]
    episode = arrange(house, 5, category, models, np.random.default_rng(5))
    placements = run_episode(house, episode, WorldOptions(fidelity=tier))
    assert [p.outcome for p in placements if p.model == name] == ["placed"] * models.count(name)


@pytest.mark.slow
def test_imported_objects_are_sampled(imported):
    house = House.load(str(imported[0].path))
    episode = house.sample_episode(objects=24, seed=1)
    assert {o.model for o in episode.objects} & set(MESHES)


REFUSED = {
    "empty": (".glb", lambda: b"", {}, "is empty"),
    "garbage": (".ply", lambda: b"nothing of the kind", {}, "cannot read"),
    "truncated": (".glb", lambda: MAKE.box((0.1, 0.1, 0.1)).export(file_type="glb")[:300], {},
        "is it complete"),
    "cut off": (".stl", lambda: MAKE.box((0.1, 0.1, 0.1)).export(file_type="stl")[:70], {},
        "no triangles|cannot"),
    "points": (".ply", lambda: trimesh.PointCloud(np.random.default_rng(0).random((50, 3))), {}, "50 points"),
    "one line": (".obj", lambda: b"v 0 0 0\nv 0.1 0 0\nv 0.2 0 0\nf 1 2 3\n", {}, "has an area"),
    "one point": (".obj", lambda: b"v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n", {}, "coincide"),
    "not a number": (".obj", lambda: b"v nan 0 0\nv inf 0 0\nv 0 nan 0\nf 1 2 3\n", {}, "finite|cannot read"),
    "no face": (".obj", lambda: b"v 0 0 0\nv 1 0 0\n", {}, "no triangles"),
    "huge": (".glb", lambda: MAKE.box((4.0, 3.0, 2.0)), {}, "too large.*--scale 0.05"),
    "tiny": (".glb", lambda: MAKE.box((0.004, 0.003, 0.002)), {}, "too small.*--scale 50"),
    "in millimetres": (".glb", lambda: MAKE.box((90.0, 50.0, 40.0)), {}, "in mm, use --units mm"),
    "of no unit": (".stl", lambda: MAKE.box((1e6, 1e6, 1e6)), {}, "in any unit"),
    "heavy": (".stl", lambda: MAKE.box((0.1, 0.1, 0.1)), {"mass": 2.0}, "2 kg .* 0.03 to 1.5 kg"),
    "dense": (".stl", lambda: MAKE.box((0.1, 0.1, 0.1)), {"density": 8000.0}, "8 kg .* use --mass"),
    "weightless": (".stl", lambda: MAKE.box((0.1, 0.1, 0.1)), {"mass": 0.0}, "--mass 0.0 is not"),
    "scaled by nothing": (".stl", lambda: MAKE.box((0.1, 0.1, 0.1)), {"scale": float("nan")}, "--scale nan"),
    "diagonal": (".stl",
        lambda: MAKE.box((0.41, 0.03, 0.03)).apply_transform(trimesh.transformations.rotation_matrix(0.79, [0, 0, 1])),
        {}, "use --scale"),
    "of another format": (".dae", lambda: b"<COLLADA/>", {}, "convert it"),
}  # fmt: skip


def test_a_piece_of_three_points_is_a_thin_sheet(tmp_path):
    """A triangle beside a box: filling its hole would close it without a volume."""
    text = MAKE.box((0.1, 0.08, 0.06)).export(file_type="obj", header=None)
    flap = "v 0.06 -0.02 0\nv 0.06 0.03 0\nv 0.06 0 0.03\nf 9 10 11\n"
    item = take(tmp_path, f"{text}\n{flap}".encode(), ".obj")
    np.testing.assert_allclose(item.size[0], 0.1105, atol=0.002)
    assert report(item.decisions, "body").startswith("repaired: 2 pieces joined")


def on_base(mesh, axis):
    """Move the base of a mesh to the origin along an axis."""
    offset = np.zeros(3)
    offset[axis] = -mesh.bounds[0, axis]
    return mesh.apply_translation(offset)


@pytest.mark.parametrize(
    ("mesh", "up", "reason"),
    [
        (on_base(MAKE.box((0.08, 0.06, 0.2)), 2), "z", "its base is at z = 0"),  # a carton as it is scanned
        (on_base(MAKE.box((0.08, 0.2, 0.06)), 1), "y", "most programs write OBJ with y up"),
        (MAKE.box((0.2, 0.15, 0.04)), "z", "stands more steadily, up to a tilt of 7"),  # a bowl or a shoe
        (MAKE.box((0.1, 0.1, 0.1)), "y", "most programs write OBJ with y up"),
        (MAKE.box((0.2, 0.04, 0.15)), "y", "most programs write OBJ with y up"),
    ],
)
def test_the_vertical_axis_of_an_obj_is_found_by_its_base_and_stability(tmp_path, mesh, up, reason):
    item = take(tmp_path, mesh, ".obj")
    assert report(item.decisions, "up").startswith(f"{up}: guessed")
    assert reason in report(item.decisions, "up")
    np.testing.assert_allclose(item.size[2], mesh.extents["xyz".index(up)], atol=1e-6)


def test_a_given_axis_is_not_guessed(tmp_path):
    item = take(tmp_path, MAKE.box((0.2, 0.15, 0.04)), ".obj", up="y")
    assert report(item.decisions, "up") == "y: given"
    assert item.size[2] == pytest.approx(0.15)


@pytest.mark.parametrize("case", REFUSED)
def test_unusable_files_are_refused_in_one_line(tmp_path, case):
    suffix, build, options, message = REFUSED[case]
    path = MeshFile(suffix, build).write(tmp_path, "it")
    with pytest.raises(AssetError, match=message) as error:
        import_object(path, ImportOptions(**options))
    assert "\n" not in str(error.value)
    if not message.startswith("--"):
        assert str(path) in str(error.value)


def valid(suffix):
    content = MAKE.icosphere(1, 0.05).export(file_type=suffix[1:])
    return content.encode() if isinstance(content, str) else content


@settings(max_examples=40, deadline=None)
@given(data=st.data(), suffix=st.sampled_from([".glb", ".obj", ".stl", ".ply"]))
def test_damaged_files_are_imported_or_refused(data, suffix, tmp_path_factory):
    content = bytearray(valid(suffix))
    for _ in range(data.draw(st.integers(1, 6))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path_factory.mktemp("damaged") / f"it{suffix}"
    path.write_bytes(content[: data.draw(st.integers(1, len(content)))])
    try:
        item = import_object(path, ImportOptions())
    except AssetError as error:
        assert "\n" not in str(error)
    else:
        assert np.isfinite(item.weight.inertia).all()


def test_units_and_axes_that_are_said_give_the_same_object(tmp_path):
    wedge = MAKE.box((0.12, 0.08, 0.04)).slice_plane([0.02, 0, 0], [-1, 0, 1], cap=True)
    want = take(tmp_path, wedge, units="m", up="z")
    lying = wedge.copy().apply_transform(Y_UP).apply_scale(1000)
    got = take(tmp_path, lying, ".ply", units="mm", up="y")
    assert got.size == pytest.approx(want.size, abs=1e-5)
    assert got.weight.mass == pytest.approx(want.weight.mass, rel=1e-4)
    assert got.weight.centre == pytest.approx(want.weight.centre, abs=1e-5)


@pytest.mark.parametrize(("longest", "unit"), [(0.2, "m"), (200.0, "mm"), (20.0, "cm"), (5.0, "in")])
def test_the_unit_is_guessed_from_the_size_and_said(tmp_path, longest, unit):
    item = take(tmp_path, MAKE.box((longest, longest / 2, longest / 3)))
    assert report(item.decisions, "unit").startswith(f"{unit}: guessed")
    assert 0.06 <= item.size.max() <= 0.32


@pytest.mark.parametrize("density", [None, 700.0])
def test_mass_and_inertia_of_a_brick_are_those_of_the_formula(tmp_path, density):
    x, y, z = 0.12, 0.08, 0.05
    item = take(tmp_path, MAKE.box((x, y, z)), density=density)
    mass = (density or 400.0) * x * y * z
    assert item.weight.mass == pytest.approx(mass, rel=1e-5)
    want = mass / 12 * np.diag([y * y + z * z, x * x + z * z, x * x + y * y])
    assert item.weight.inertia == pytest.approx(want, abs=1e-8)
    assert item.weight.centre == pytest.approx([0, 0, z / 2], abs=1e-6)


def test_a_body_that_cuts_itself_has_an_inertia_that_can_be():
    box = trimesh.creation.box((0.1, 0.08, 0.06))
    box.vertices[:] = box.vertices[[7, 1, 4, 5, 6, 4, 3, 2]]
    low, middle, high = np.linalg.eigvalsh(weigh(box, mass=0.1, density=None).inertia)
    assert low > 0 and high <= (low + middle) * (1 + 1e-9)


def test_a_hollow_ball_weighs_what_its_shell_weighs(tmp_path):
    item = take(tmp_path, MESHES["hollow_ball"].build(), density=1000.0)
    assert item.weight.mass == pytest.approx(1000 * 4 / 3 * np.pi * (0.06**3 - 0.055**3), rel=0.03)


def test_overlapping_pieces_count_once(tmp_path):
    bars = [MAKE.box((0.2, 0.04, 0.04)), MAKE.box((0.04, 0.2, 0.04))]
    item = take(tmp_path, trimesh.util.concatenate(bars), density=1000.0)
    assert item.weight.mass == pytest.approx(1000 * (2 * 0.2 - 0.04) * 0.04**2, rel=1e-4)


def test_a_stick_on_end_is_laid_down_and_a_cup_stays_upright(tmp_path):
    stick = take(tmp_path, MAKE.cylinder(0.012, 0.3))
    assert stick.size[2] < 0.03
    cup = take(tmp_path, MESHES["cup"].build())
    assert cup.size[2] == pytest.approx(0.1, abs=1e-3)
    assert "as in the file" in report(cup.decisions, "rests")


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_the_pose_is_steady_or_the_file_s_own(seed):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(30, 3)) * rng.uniform(0.02, 0.1, 3)
    centre = trimesh.convex.convex_hull(points).center_mass
    pose = resting_pose(points, centre)
    assert pose.rotation @ pose.rotation.T == pytest.approx(np.eye(3), abs=1e-9)
    assert np.linalg.det(pose.rotation) == pytest.approx(1.0)
    placed = points @ pose.rotation.T
    support = placed[placed[:, 2] < placed[:, 2].min() + 5e-4, :2]
    if pose.tilt >= STEADY:  # the centre of mass lies above what touches the floor
        low, high = support.min(axis=0), support.max(axis=0)
        middle = (pose.rotation @ centre)[:2]
        assert np.all(middle > low) and np.all(middle < high)


@pytest.mark.slow
@pytest.mark.parametrize("name", HOLLOW)
def test_grips_are_on_something_at_the_top(tmp_path, name):
    item = take(tmp_path, HOLLOW[name]())
    look = trimesh.Trimesh(item.visual.vertices, item.visual.faces)
    points, _ = trimesh.sample.sample_surface(look, 100_000, seed=1)
    gaps = np.linalg.norm(points - item.grip.point, axis=1)
    assert gaps.min() < 0.003
    assert points[gaps.argmin(), 2] > points[:, 2].max() - 0.012
    assert np.hypot(*(item.grip.point - item.weight.centre)[:2]) < 0.12


def test_a_shape_that_no_hand_can_hold_is_refused_with_a_picture(tmp_path, capsys):
    path = MeshFile(".stl", lambda: tetrahedron(-0.1, -0.1, 0.1)).write(tmp_path, "horn")
    own = tmp_path / "own"
    assert run(path, "--category", "toys", "--out", own) == 2
    said = capsys.readouterr().err
    picture = own / "horn-preview.png"
    assert f"{path}: this shape cannot be held: its top is 1" in said and f"({picture} shows it)" in said
    assert said.count("\n") == 1 and ".mjsim-work" not in said
    assert list(contents(own)) == [picture]


@pytest.mark.parametrize(
    ("suffix", "away", "want"),
    [
        (".obj", 5e6, "lies 5e\\+06 from"),
        (".stl", 5e6, "32 bits .* move it to the origin"),
        (".ply", 30.0, "lies 30 "),
    ],
)
def test_what_lies_far_from_its_origin_is_moved_or_refused(tmp_path, suffix, away, want):
    brick = MAKE.box((0.12, 0.07, 0.05)).apply_translation((away, 0, 0))
    if suffix == ".stl":
        with pytest.raises(AssetError, match=want):
            take(tmp_path, brick, suffix)
        return
    item = take(tmp_path, brick, suffix, up="z")
    assert re.search(want, report(item.decisions, "place"))
    assert item.size == pytest.approx((0.12, 0.07, 0.05), abs=1e-5)
    assert item.weight.centre == pytest.approx((0, 0, 0.025), abs=1e-5)


def test_parts_cover_the_body(tmp_path):
    item = take(tmp_path, MESHES["table"].build())
    assert len(item.hulls) > 1
    hulls = [Delaunay(points) for points in item.hulls]
    for inside in ([0, 0, 0.1], [0.07, 0.05, 0.05], [-0.07, -0.05, 0.05]):
        assert any(hull.find_simplex(inside) >= 0 for hull in hulls)
    assert all(hull.find_simplex([0, 0, 0.04]) < 0 for hull in hulls)  # between the legs


@pytest.mark.slow
def test_a_ball_in_a_wire_ring_stays_and_collides(tmp_path):
    ring = MAKE.torus(0.11, 0.004, major_sections=24, minor_sections=8)
    pieces = [ring, MAKE.icosphere(1, 0.04)]
    item = take(tmp_path, trimesh.util.concatenate(pieces))
    assert np.ptp(item.visual.vertices[:, 2]) == pytest.approx(0.08, abs=0.002)
    assert item.size[2] > 0.078


def test_one_colour_stays_a_colour_and_is_shown_as_gltf_means_it(tmp_path):
    item = take(tmp_path, plain(MAKE.box((0.1, 0.1, 0.1)), 0.2159, 0.0, 1.0), ".glb")
    assert item.visual.picture is None
    assert item.visual.colour == pytest.approx((0.5, 0.0, 1.0), abs=0.005)  # linear 0.2159 is sRGB 0.5


def test_a_texture_lands_where_it_was(tmp_path):
    item = take(tmp_path, MESHES["textured_box"].build(), ".glb")
    look = item.visual
    assert look.picture is not None and look.uv is not None
    corners = look.vertices[look.faces]
    up = np.flatnonzero(np.all(corners[..., 2] > item.size[2] - 1e-4, axis=1))
    pixels = np.asarray(picture(), np.uint8)
    for weights in np.random.default_rng(0).dirichlet((2, 2, 2), 40):
        for face in up:
            x, y, _ = weights @ corners[face]
            u, v = weights @ look.uv[face]
            got = look.picture[int((1 - v) * SIDE), int(u * SIDE)].astype(int)
            row, column = (0.5 - y / 0.16) * 64, (x / 0.12 + 0.5) * 64
            near = pixels[
                int(max(row - 1.5, 0)) : int(row + 2.5), int(max(column - 1.5, 0)) : int(column + 2.5)
            ]
            if np.ptp(near.reshape(-1, 3), axis=0).max() == 0:  # not at an edge of the picture's squares
                assert np.abs(got - near[0, 0].astype(int)).max() < 12


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 1000), count=st.integers(1, 300))
def test_triangles_of_an_atlas_do_not_overlap(seed, count):
    rng = np.random.default_rng(seed)
    atlas = Atlas.pack(rng.normal(size=(count, 3, 3)) * rng.lognormal(0, 1, (count, 1, 1)))
    taken = np.zeros((SIDE, SIDE), int)
    for x, y, w, h in atlas.blocks:
        assert min(x, y) >= 0 and max(x + w, y + h) <= SIDE
        taken[y : y + h, x : x + w] += 1
    assert taken.max() == 1
    assert np.all((atlas.uv >= 0) & (atlas.uv <= 1))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["truck", "many_parts", "torn_ball"])
def test_the_same_file_gives_the_same_bytes(tmp_path, name):
    mesh = MESHES[name]
    path = mesh.write(tmp_path, name)
    made = []
    for folder in (tmp_path / "a", tmp_path / "b"):
        add_mesh(path, HouseExtension(folder), CatalogueEntry.named(name, mesh.category), mesh.options)
        made.append({path.relative_to(folder): content for path, content in contents(folder).items()})
    assert made[0] == made[1]


def brick(tmp_path):
    return MESHES["brick"].write(tmp_path, "brick")


def add(tmp_path, own, label="brick", category="toys", *, force=False, **options):
    """Import a brick into a house extension; the decisions."""
    extension, entry = HouseExtension(own), CatalogueEntry.named(label, category)
    return add_mesh(brick(tmp_path), extension, entry, ImportOptions(**options), force=force)


def contents(folder):
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def run(*words):
    return cli.main(["import", "object", *map(str, words)])


def test_the_command_imports_reports_and_never_overwrites(tmp_path, capsys):
    words = (brick(tmp_path), "--category", "toys", "--out", tmp_path / "own")
    assert run(*words) == 0
    out = capsys.readouterr().out
    assert "guessed from the size" in out and "catalogue.toml" in out
    files = contents(tmp_path / "own")
    names = ["catalogue.toml", "look.obj", "object.xml", "part_0.obj", "preview.png", "report.json"]
    assert sorted(path.name for path in files) == names
    assert run(*words) == 2
    assert "--force" in capsys.readouterr().err
    assert contents(tmp_path / "own") == files
    assert run(*words, "--force", "--mass", "0.5") == 0
    catalogue = Catalogue.load(str(tmp_path / "own" / "catalogue.toml"))
    assert "brick" in catalogue.categories["toys"].objects
    model = mujoco.MjModel.from_xml_path(str(catalogue.objects["brick"].path))
    assert model.body_mass[1] == pytest.approx(0.5)
    assert (tmp_path / "own" / "catalogue.toml").read_text(encoding="utf-8").count("[objects.brick]") == 1


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--category", "spoons"), "no category 'spoons'; there are dishes"),
        (("--category", "toys", "--name", "Ball"), "already has an object 'ball'"),
        (("--category", "toys", "--name", "!!"), "--name '!!'"),
        (("--category", "toys", "--scale", "0"), "--scale 0.0"),
        (("--category", "office", "--scale", "2.6"), "do not fit into 'Office supply box'"),
        (("--category", "toys", "--house", "castle"), "no house 'castle'"),
        (("--category", "toys", "--mass", "1", "--density", "3"), "not allowed with"),
    ],
)
def test_bad_options_are_one_line_and_leave_nothing(tmp_path, capsys, words, message):
    path = brick(tmp_path)
    try:
        assert run(path, "--out", tmp_path / "own", *words) == 2
    except SystemExit as stop:  # argparse
        assert stop.code == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "own").exists()


def test_four_that_fit_by_volume_but_not_beside_each_other_are_refused(tmp_path, capsys):
    """A third of these fails in the office box, whose room is that of eight."""
    MAKE.box((0.15, 0.13, 0.13)).export(tmp_path / "long.stl")
    words = (tmp_path / "long.stl", "--category", "office", "--out", tmp_path / "own")
    assert run(*words) == 2
    line = capsys.readouterr().err
    assert "4 of these do not fit into 'Office supply box'" in line
    assert run(*words, "--scale", re.search(r"--scale ([\d.]+)", line)[1]) == 0


OTHER_SIZES = ((0.26, 0.2, 0.04), (0.26, 0.1, 0.1), (0.12, 0.12, 0.17))


@pytest.mark.slow
@pytest.mark.parametrize(
    "size",
    [
        (0.25, 0.13, 0.11),
        *(pytest.param(size, marks=pytest.mark.slow) for size in OTHER_SIZES),
    ],
)
def test_a_bin_holds_as_many_as_were_counted(size, tmp_path):
    MAKE.box(size).export(tmp_path / "box.stl")
    catalogue, own = Catalogue.load("apartment"), tmp_path / "own"
    room = 2 * compiled_house(catalogue).receptacles["office_box"].half_size
    count = held_in(room, np.array(size))
    assert count >= 4
    add_mesh(
        tmp_path / "box.stl",
        HouseExtension(own),
        CatalogueEntry.named("box", "office"),
        ImportOptions(mass=0.3),
    )
    house = House.load(str(own / "catalogue.toml"))
    episode = arrange(house, 0, house.catalogue.categories["office"], ["box"] * 6, np.random.default_rng(0))
    placements = run_episode(house, episode, WorldOptions(fidelity="event"))
    assert [placement.outcome for placement in placements[:count]] == ["placed"] * count


@pytest.mark.slow
def test_a_surface_that_cuts_itself_is_known_and_does_not_take_minutes(tmp_path):
    """CoACD takes 40 s for parts of the usual fineness of this one."""
    ball = MAKE.icosphere(subdivisions=3, radius=0.07)
    assert not cuts_itself(ball) and not cuts_itself(HOLLOW["ring"]())
    ball.vertices += np.random.default_rng(0).normal(0.0, 0.005, ball.vertices.shape)
    assert cuts_itself(ball)
    began = time.process_time()
    take(tmp_path, ball)
    assert time.process_time() - began < 10.0


@pytest.mark.parametrize("force", [False, True])
def test_a_failure_while_installing_leaves_all_as_it_was(tmp_path, monkeypatch, force):
    own = tmp_path / "own"
    monkeypatch.setattr(WRITE_PREVIEW, lambda *_: None)
    add(tmp_path, own, "first")
    if force:
        add(tmp_path, own)
    before, extension = contents(own), HouseExtension(own)

    def fail(*_):
        raise OSError("disk full")

    monkeypatch.setattr("mjsim.importing.object.house_extension.load_catalogue", fail)
    with pytest.raises(OSError, match="disk full"):
        add_mesh(
            brick(tmp_path),
            extension,
            CatalogueEntry.named("brick", "toys"),
            ImportOptions(mass=0.4),
            force=force,
        )
    assert contents(own) == before


def test_an_import_that_was_killed_before_the_catalogue_named_it_is_done_again(tmp_path):
    own = tmp_path / "own"
    child = os.fork()
    if child == 0:
        house_extension.write_text_atomically = lambda *_: os.kill(os.getpid(), signal.SIGKILL)
        try:
            add(tmp_path, own)
        finally:
            os._exit(1)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == -signal.SIGKILL
    assert (own / "brick").is_dir() and not (own / "catalogue.toml").exists()
    add(tmp_path, own)
    assert "brick" in Catalogue.load(str(own / "catalogue.toml")).objects
    remove_leftovers(own, max_age=0)
    assert sorted(path.name for path in own.iterdir()) == ["brick", "catalogue.toml"]
    assert not [path for path in (own / "brick").iterdir() if path.name.startswith(".")]
    with pytest.raises(AssetError, match="already there"):
        add(tmp_path, own)


def test_a_folder_that_was_not_imported_is_not_replaced(tmp_path):
    own = tmp_path / "own"
    (own / "brick").mkdir(parents=True)
    (own / "brick" / "notes.txt").write_text("mine", encoding="utf-8")
    with pytest.raises(AssetError, match="is not an imported object"):
        add(tmp_path, own, force=True)
    assert (own / "brick" / "notes.txt").read_text(encoding="utf-8") == "mine"


def test_without_opengl_an_object_is_imported_without_its_picture(tmp_path, monkeypatch):
    def fail(*_):
        raise RenderError("no OpenGL")

    monkeypatch.setattr(WRITE_PREVIEW, fail)
    assert report(add(tmp_path, tmp_path / "own"), "preview") == "none: no OpenGL"
    written = json.loads((tmp_path / "own/brick/report.json").read_text(encoding="utf-8"))
    assert written[-1]["reason"] == "no OpenGL"


def test_without_the_extra_the_command_says_what_to_install(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("mjsim.importing.EXTRA", ("numpy", "no_such_library"))
    assert run(brick(tmp_path), "--category", "toys", "--out", tmp_path / "own") == 2
    said = capsys.readouterr().err
    assert "no_such_library: pip install 'mjsim[import]'" in said and said.count("\n") == 1


def test_a_catalogue_extends_one_that_extends_another(tmp_path, monkeypatch):
    monkeypatch.setattr(WRITE_PREVIEW, lambda *_: None)
    add(tmp_path, tmp_path / "a", "Red brick")
    second = HouseExtension(tmp_path / "b", str(tmp_path / "a" / "catalogue.toml"))
    found = add_mesh(brick(tmp_path), second, CatalogueEntry.named("Green brick", "books"), ImportOptions())
    assert report(found, "file").startswith("brick.stl")
    catalogue = Catalogue.load(str(tmp_path / "b" / "catalogue.toml"))
    assert catalogue.objects["red_brick"].label == "Red brick"
    assert catalogue.categories["books"].objects[-1] == "green_brick"
    assert set(catalogue.objects) - set(Catalogue.load().objects) == {"red_brick", "green_brick"}
    with pytest.raises(AssetError, match="choose another --out"):
        HouseExtension(tmp_path / "b", "apartment")


def test_catalogues_that_extend_each_other_are_refused(tmp_path):
    for name, other in (("a", "b"), ("b", "a")):
        (tmp_path / f"{name}.toml").write_text(f'extends = "{other}.toml"\n', encoding="utf-8")
    with pytest.raises(AssetError, match=r"does not lead to a complete catalogue"):
        Catalogue.load(str(tmp_path / "a.toml"))
