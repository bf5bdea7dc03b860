import math
from pathlib import Path

import mujoco
import numpy as np
import pytest
from houses_cases import PALETTE, compiled

from mjsim.generator.furniture.appearance import Appearance, draw_appearance
from mjsim.generator.furniture.catalogue import KINDS
from mjsim.generator.furniture.drawn_boxes import drawn_boxes
from mjsim.generator.furniture.piece import BIN_SIZES, Piece, Point, flattened, intersect, moved_boxes
from mjsim.house.validation.checked_model import Compiled
from mjsim.house.validation.drawn import coplanar_faces

SLACK = 0.03  # m
Members = list[tuple[str, float, float, np.ndarray]]  # kinds, positions and drawn boxes


@pytest.fixture(scope="module")
def look() -> Appearance:
    return draw_appearance(PALETTE, np.random.default_rng(0))


@pytest.fixture(scope="module", params=sorted(KINDS))
def pieces(request: pytest.FixtureRequest, look: Appearance) -> list[tuple[Piece, mujoco.MjModel]]:
    """Pieces of one kind, large and small, each with its model."""
    made = [make(request.param, look, seed, smaller=seed % 3) for seed in range(4)]
    return [(piece, compiled(piece, look)) for piece in made]


def make(kind: str, look: Appearance, seed: int, smaller: int = 0, fit: Point | None = None) -> Piece:
    return KINDS[kind].make(np.random.default_rng(seed), look, smaller=smaller, fit=fit)


def extents(model: mujoco.MjModel) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper corners of all geoms that are no shadows, each (k, 3), and which collide."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    low, high = [], []
    for geom in range(model.ngeom):
        if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE:
            continue
        axes = data.geom_xmat[geom].reshape(3, 3)
        middle = data.geom_xpos[geom] + axes @ model.geom_aabb[geom, :3]
        reach = np.abs(axes) @ model.geom_aabb[geom, 3:]
        low.append(middle - reach)
        high.append(middle + reach)
    return np.array(low), np.array(high)


def test_there_are_sixty_kinds() -> None:
    assert len(KINDS) >= 60


def test_a_piece_compiles_and_stays_within_its_size(pieces: list[tuple[Piece, mujoco.MjModel]]) -> None:
    for piece, model in pieces:
        low, high = extents(model)
        w, d, h = piece.size
        assert low[:, 2].min() > -0.01
        assert low[:, 0].min() > -w / 2 - SLACK and high[:, 0].max() < w / 2 + SLACK
        if piece.stands != "ceiling":
            assert (
                low[:, 1].min() > (-0.08 if piece.stands == "recess" else -SLACK)
                and high[:, 1].max() < d + SLACK
            )
        assert high[:, 2].max() < max(h, 2.6 if "dining" in piece.kind else 0) + SLACK
        for part in piece.parts:
            x0, y0, x1, y1 = part.spot
            assert -w / 2 - 1e-6 <= x0 < x1 <= w / 2 + 1e-6 and -1e-6 <= y0 < y1 <= d + 1e-6


def test_what_collides_is_within_the_parts(pieces: list[tuple[Piece, mujoco.MjModel]]) -> None:
    """Ways are looked for around the parts: nothing that stands in a way may be outside of them."""
    for piece, model in pieces:
        low, high = extents(model)
        solid = [g for g in range(model.ngeom) if model.geom_type[g] != mujoco.mjtGeom.mjGEOM_PLANE]
        for k, geom in enumerate(solid):
            if not model.geom_contype[geom] or low[k, 2] > 1.8 or high[k, 2] < 0.05:
                continue
            boxes = [np.array(part.hit) for part in piece.parts]
            assert (
                any(
                    (low[k, :2] >= box[:2] - 0.025).all() and (high[k, :2] <= box[2:] + 0.025).all()
                    for box in boxes
                )
                or len(boxes) > 1
            ), (low[k], high[k])


def test_objects_do_not_get_under_low_furniture_where_no_hand_reaches_them(
    pieces: list[tuple[Piece, mujoco.MjModel]],
) -> None:
    """A magazine fits under a gap of 2 cm. Shallow pieces such as radiators do not hide them."""
    for piece, model in pieces:
        low, high = extents(model)
        solid = np.flatnonzero(model.geom_type != mujoco.mjtGeom.mjGEOM_PLANE)
        hits = model.geom_contype[solid] > 0
        low, high = low[hits], high[hits]
        middle = (low + high) / 2
        for k in np.flatnonzero((low[:, 2] > 0.012) & (low[:, 2] < 0.25) & (high[:, 1] - low[:, 1] > 0.12)):
            over = (low[:, :2] <= middle[k, :2] + 1e-6) & (high[:, :2] >= middle[k, :2] - 1e-6)
            below = over.all(axis=1) & (low[:, 2] < 0.02) & (high[:, 2] > low[k, 2] - 0.02)
            assert below.any(), (piece.kind, low[k], high[k])


def test_the_boxes_of_a_piece_are_those_of_its_drawn_geoms(
    pieces: list[tuple[Piece, mujoco.MjModel]],
) -> None:
    """MuJoCo's boxes around rotated ellipsoids and cylinders are too large, so only upright geoms are equal."""
    for piece, model in pieces:
        if piece.members:
            continue
        low, high = extents(model)
        solid = [g for g in range(model.ngeom) if model.geom_type[g] != mujoco.mjtGeom.mjGEOM_PLANE]
        drawn = [k for k, g in enumerate(solid) if model.geom_group[g] != 3]
        for box, k in zip(piece.drawn, drawn, strict=False):
            assert (box[:3] >= low[k] - 1e-3).all() and (box[3:] <= high[k] + 1e-3).all()
            if model.geom_quat[solid[k], 0] == 1.0:
                assert (*box[:3], *box[3:]) == pytest.approx((*low[k], *high[k]), abs=1e-3)


@pytest.mark.parametrize(
    ("geom", "half"),
    [
        ('type="ellipsoid" size=".3 .1 .1" euler="0 0 0.785398"', (math.sqrt(0.05), math.sqrt(0.05), 0.1)),
        ('type="capsule" size=".05" fromto="-.2 0 0 .2 0 0"', (0.25, 0.05, 0.05)),
        ('type="cylinder" size=".05" fromto="-.2 0 0 .2 0 0"', (0.2, 0.05, 0.05)),
        ('type="cylinder" size=".1 .02" euler="1.570796 0 0"', (0.1, 0.02, 0.1)),
        ('size=".3 .2 .01" xyaxes="-1 0 0 0 0 1"', (0.3, 0.01, 0.2)),
        ('class="wall_x" size=".3 .2 .01"', (0.01, 0.3, 0.2)),
        ('type="sphere" size=".1"', (0.1, 0.1, 0.1)),
    ],
)
def test_the_box_of_a_rotated_geom_is_tight(geom: str, half: tuple[float, ...]) -> None:
    found = drawn_boxes(f"<geom {geom}/>")
    assert found == pytest.approx(np.array([[*(-v for v in half), *half]]), abs=1e-5)


def test_guards_and_shadows_are_not_drawn() -> None:
    assert not len(drawn_boxes('<geom class="guard" size="1 1 1"/><geom class="shadow" size="1 1 1"/>'))


def test_no_faces_of_a_piece_flicker(pieces: list[tuple[Piece, mujoco.MjModel]]) -> None:
    for piece, model in pieces:
        found = coplanar_faces(Compiled.of("piece", Path("piece.xml"), model))
        assert not [f for f in found if f.place[1] > 0.002], piece.kind  # the back faces a wall


@pytest.mark.parametrize("kind", ["low_bookcase", "cube_shelf", "bookcase"])
def test_things_in_a_shelf_do_not_reach_through_its_boards(kind: str, look: Appearance) -> None:
    for seed in range(40):
        piece = make(kind, look, seed)
        sizes = piece.drawn[:, 3:] - piece.drawn[:, :3]
        upright = np.isclose(sizes[:, 0], 0.024) & (sizes[:, 2] > 0.5)
        frame = upright | (sizes[:, 0] > piece.size[0] - 0.049)
        assert upright.sum() >= 2
        assert not intersect(piece.drawn[frame], piece.drawn[~frame]), seed


def test_the_texture_of_a_picture_follows_from_its_seed(look: Appearance) -> None:
    one, same, other = (make("picture", look, seed).pictures[0] for seed in (1, 1, 2))
    assert one.name == same.name != other.name
    assert one.draw() == one.draw() == same.draw() != other.draw()


def test_a_table_is_apart_from_the_long_part_of_a_corner_sofa(look: Appearance) -> None:
    lounge = make("lounge", look, 26)  # a full-size table would be too wide for its narrow sofa
    boxes = {piece.kind: moved_boxes(piece.drawn, *pose) for piece, *pose in flattened(lounge)}
    around = boxes["coffee_table"] + np.array([-0.08, -0.08, 0.0, 0.08, 0.08, 0.0])
    assert not intersect(boxes["corner_sofa"], around)


@pytest.fixture(scope="module")
def lounges(look: Appearance) -> list[Members]:
    """The members of lounges in deep rooms."""
    fits = ((5.06, -0.8, 0.0), (5.06, 0.0, 0.0), (5.26, 0.8, 0.0))
    return [
        [
            (piece.kind, x, y, moved_boxes(piece.drawn, x, y, yaw))
            for piece, x, y, yaw in flattened(make("lounge", look, seed, seed % 3, fits[seed % 3]))
        ]
        for seed in range(41, 75)
    ]


def test_the_seats_of_a_lounge_are_near_its_television_or_stove(
    lounges: list[Members],
) -> None:
    for lounge in lounges:
        at = {kind: (x, y) for kind, x, y, _ in lounge}
        focus = at.get("television") or at["stove"]
        assert math.dist(focus, at.get("sofa") or at["corner_sofa"]) < 5.0


def test_the_edges_of_a_rug_are_not_flush_with_the_legs_on_it(
    lounges: list[Members],
) -> None:
    for lounge in lounges:
        others = np.concatenate([drawn for kind, *_, drawn in lounge if kind != "rug"])
        legs = others[others[:, 2] < 0.001]
        for rug in (drawn[0] for kind, *_, drawn in lounge if kind == "rug"):
            for axis, across in ((0, 1), (1, 0)):
                beside = (legs[:, across] < rug[across + 3]) & (legs[:, across + 3] > rug[across])
                gaps = legs[beside][:, [axis, axis + 3]] - rug[[axis, axis + 3]]
                assert np.abs(gaps).min(initial=1.0) > 0.0003


def test_bins_on_furniture_overlap_nothing(pieces: list[tuple[Piece, mujoco.MjModel]]) -> None:
    for piece, _ in pieces:
        for mount in piece.mounts:
            (x0, y0, x1, y1), z = mount.spot, mount.position[2]
            box = np.array([[x0, y0, z, x1, y1, z + BIN_SIZES[mount.receptacle][2]]])
            assert not intersect(box, piece.drawn[np.abs(piece.drawn - box).max(axis=1) > 1e-3]), piece.kind


def test_places_are_on_surfaces_that_collide(pieces: list[tuple[Piece, mujoco.MjModel]]) -> None:
    for piece, model in pieces:
        low, high = extents(model)
        solid = [g for g in range(model.ngeom) if model.geom_type[g] != mujoco.mjtGeom.mjGEOM_PLANE]
        hard = np.array([bool(model.geom_contype[g]) for g in solid])
        for x, y, z in piece.places:
            under = hard & (low[:, :2] <= (x, y)).all(axis=1) & (high[:, :2] >= (x, y)).all(axis=1)
            assert np.abs(high[under, 2] - z).min() < 0.012, piece.kind


@pytest.mark.parametrize("kind", sorted(KINDS))
def test_a_seed_gives_the_same_piece_and_another_seed_another(kind: str, look: Appearance) -> None:
    pieces = [make(kind, look, seed) for seed in (1, 1, 2, 3, 4, 5, 6)]
    assert pieces[0] == pieces[1]
    assert len({repr(piece) for piece in pieces[1:]}) >= 3
