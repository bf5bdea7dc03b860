"""Seeing by rays: walls and objects block, the field of view has edges, and a dense oracle agrees."""

import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from mjsim.episode import Episode, PlacedObject, StartPose
from mjsim.model.catalogue import Catalogue
from mjsim.model.scene import Scene, compose
from mjsim.person_parameters import PersonParameters
from mjsim.sight_lines import OFFSETS
from mjsim.visibility import FieldOfView, visible_objects
from planner.navmesh import NavMesh

EYE_HEIGHT = 1.6
USUAL = FieldOfView.of(PersonParameters())


Placed = list[tuple[str, float, float]]


def _stand(
    catalogue: Catalogue,
    placed: Placed,
    eye: tuple[float, float, float],
    heading: float,
    *,
    avatar: bool = False,
) -> tuple[Scene, mujoco.MjData]:
    """The small house with (model, x, y) on the floor, named by model and number, and a person below the eye."""
    objects = tuple(
        PlacedObject(f"{m}_{i}", catalogue.objects[m].category, m, (x, y), (x, y, 0.0), (1.0, 0.0, 0.0, 0.0))
        for i, (m, x, y) in enumerate(placed)
    )
    episode = Episode(
        catalogue.name, 0, StartPose(eye[0], eye[1], heading), objects, tuple(catalogue.receptacles),
        {o.name: catalogue.categories[catalogue.objects[o.model].category].receptacle for o in objects},
    )  # fmt: skip
    scene = compose(episode, catalogue, avatar=avatar)
    data = mujoco.MjData(scene.model)
    mujoco.mj_forward(scene.model, data)
    return scene, data


def _look(
    catalogue: Catalogue, placed: Placed, eye: tuple[float, float, float], heading: float,
    pitch: float = 0.0, field: FieldOfView | None = None, *, avatar: bool = False,
) -> tuple[str, ...]:  # fmt: skip
    scene, data = _stand(catalogue, placed, eye, heading, avatar=avatar)
    return visible_objects(scene, data, eye, heading, pitch, field=field)


def test_sees_what_is_ahead_only(small_catalogue: Catalogue) -> None:
    around = [("cube", 2.5, 1.0), ("ball", 0.2, 1.0), ("wedge", 1.0, 2.5), ("cube", 1.0, 0.2)]
    eye = (1.0, 1.0, 0.3)
    for heading, seen in [
        (0.0, "cube_0"),
        (math.pi, "ball_1"),
        (math.pi / 2, "wedge_2"),
        (-math.pi / 2, "cube_3"),
    ]:
        assert _look(small_catalogue, around, eye, heading) == (seen,)


def test_order_is_the_episodes(small_catalogue: Catalogue) -> None:
    placed = [("ball", 2.5, 1.3), ("cube", 2.5, 0.7), ("ball", 2.5, 1.0)]
    assert _look(small_catalogue, placed, (1, 1, 0.3), 0.0) == ("ball_0", "cube_1", "ball_2")


def test_nothing_to_see(small_catalogue: Catalogue) -> None:
    assert _look(small_catalogue, [], (1, 1, 0.3), 0.0) == ()
    assert _look(small_catalogue, [("cube", 0.2, 1)], (1, 1, 0.3), 0.0) == ()


def test_walls_block_and_doorways_do_not(small_catalogue: Catalogue) -> None:
    eye = (1.5, 2.0, EYE_HEIGHT)
    down = -0.35
    assert _look(small_catalogue, [("cube", 5.0, 2.0)], eye, 0.0, down) == ("cube_0",)
    assert _look(small_catalogue, [("cube", 5.0, 0.5)], eye, -0.4, down) == ()


def test_other_objects_block(small_catalogue: Catalogue) -> None:
    """A cube hides a ball that is exactly behind it, seen from near the floor."""
    eye, behind = (0.5, 1.0, 0.05), ("ball", 2.0, 1.0)
    assert _look(small_catalogue, [("cube", 1.0, 1.0), behind], eye, 0.0) == ("cube_0",)
    assert _look(small_catalogue, [("cube", 1.0, 1.4), behind], eye, 0.0) == ("cube_0", "ball_1")


def test_objects_in_a_receptacle_are_seen_from_above_only(small_catalogue: Catalogue) -> None:
    crate = [("cube", 0.3, 3.7)]
    near = (0.9, 3.1, EYE_HEIGHT)
    assert _look(small_catalogue, crate, near, 2.356, -1.1) == ("cube_0",)
    assert _look(small_catalogue, crate, (1.5, 2.5, 0.1), 2.356, 0.0) == ()


def test_own_body_does_not_block(small_catalogue: Catalogue) -> None:
    args = (small_catalogue, [("cube", 1.6, 1.0)], (1.0, 1.0, EYE_HEIGHT), 0.0, -1.1)
    assert _look(*args, avatar=True) == _look(*args) == ("cube_0",)


@pytest.mark.parametrize("hand", ["left", "right"])
def test_own_hands_do_not_block(small_catalogue: Catalogue, hand: str) -> None:
    """A cube that is exactly behind a hand, as the eye sees it."""
    eye, heading = np.array([0.6, 2.0, EYE_HEIGHT]), 0.0
    scene, data = _stand(small_catalogue, [], tuple(eye), heading, avatar=True)
    ray = data.body(f"avatar/{hand}_hand").xpos - eye
    x, y, _ = eye - ray * eye[2] / ray[2]
    geom = np.full(1, -1, np.int32)
    mujoco.mj_ray(scene.model, data, eye, ray, np.array([1, 1, 1, 0, 0, 0], np.uint8), True, -1, geom)
    assert (
        scene.model.body(scene.model.geom_bodyid[geom[0]]).name == f"avatar/{hand}_hand"
    )  # it is in the way
    args = (small_catalogue, [("cube", float(x), float(y))], tuple(eye), heading, -0.6)
    assert _look(*args, avatar=True) == _look(*args) == ("cube_0",)


@pytest.mark.parametrize("sign", [-1, 1])
def test_edges_of_the_field(small_catalogue: Catalogue, sign: int) -> None:
    """The cube is at a known bearing; fields just wide and just narrow enough for it."""
    eye, cube = (0.5, 2.0, 0.05), [("cube", 2.5, 2.0)]
    half = math.atan(0.05 / 1.95)  # of the cube as seen
    off = math.radians(30)
    wide, narrow = 2 * (off + half), 2 * (off - half)
    for axis in ("horizontal", "vertical"):
        turn = {"horizontal": (sign * off, 0.0), "vertical": (0.0, sign * off)}[axis]
        assert _look(small_catalogue, cube, eye, *turn, replace(USUAL, **{axis: wide})) == ("cube_0",)
        assert _look(small_catalogue, cube, eye, *turn, replace(USUAL, **{axis: narrow})) == ()


def test_range(small_catalogue: Catalogue) -> None:
    eye, cube = (0.5, 2.0, 0.05), [("cube", 2.5, 2.0)]
    assert _look(small_catalogue, cube, eye, 0.0, 0.0, replace(USUAL, range=2.1)) == ("cube_0",)
    assert _look(small_catalogue, cube, eye, 0.0, 0.0, replace(USUAL, range=1.9)) == ()


def _unblocked_share(
    scene: Scene, data: mujoco.MjData, alone: mujoco.MjModel, eye: NDArray[np.float64], name: str
) -> float:
    """Among dense single rays that would meet an object if it were alone, how many do."""
    geoms = scene.index.geoms(name)
    geoms = geoms[scene.model.geom_group[geoms] <= 2]
    rng = np.random.default_rng(0)
    targets = np.vstack(
        [data.geom_xpos[g] + scene.model.geom_rbound[g] * rng.uniform(-1, 1, (400, 3)) for g in geoms]
    )
    shown, only_five = np.array([1, 1, 1, 0, 0, 0], np.uint8), np.array([0, 0, 0, 0, 0, 1], np.uint8)
    alone.geom_group[:] = 0
    alone.geom_group[geoms] = 5
    met = possible = 0
    for ray in targets - eye:
        if mujoco.mj_ray(alone, data, eye, ray, only_five, True, -1, None) >= 0:
            possible += 1
            geom = np.full(1, -1, np.int32)
            mujoco.mj_ray(scene.model, data, eye, ray, shown, True, -1, geom)
            met += int(geom[0] in geoms)
    assert possible > 0
    return met / possible


def _seen_by_every_ray(
    scene: Scene, data: mujoco.MjData, eye: NDArray[np.float64], field: FieldOfView
) -> set[str]:
    """Objects in view along +x as `visible_objects` defines it, with every ray cast and no culling."""
    model, owner, groups = scene.model, scene.index.geom_owner, np.array([1, 1, 1, 0, 0, 0], np.uint8)
    seen, geom = set(), np.zeros(1, np.int32)
    for i, name in enumerate(scene.index.names):
        geoms = np.flatnonzero((owner == i) & (model.geom_group <= 2))
        turned = data.geom_xmat[geoms].reshape(-1, 3, 3)
        middles = data.geom_xpos[geoms] + (turned @ model.geom_aabb[geoms, :3, None])[..., 0]
        halves = (abs(turned) @ model.geom_aabb[geoms, 3:, None])[..., 0]
        low, high = (middles - halves).min(axis=0), (middles + halves).max(axis=0)
        for offset in OFFSETS:
            forward, left, up = ray = (low + high) / 2 + (high - low) / 2 * offset - eye
            inside = (
                abs(left) <= forward * math.tan(field.horizontal / 2) and np.linalg.norm(ray) <= field.range
            )
            if inside and abs(up) <= forward * math.tan(field.vertical / 2):
                mujoco.mj_ray(model, data, eye, ray, groups, True, -1, geom)
                if owner[geom[0]] == i:
                    seen.add(name)
    return seen


def test_culling_changes_no_answer(episode: Episode, catalogue: Catalogue, navmesh: NavMesh) -> None:
    """Field of view, occluders and early exits save rays; what is seen is what all rays together meet."""
    house_scene = compose(episode, catalogue, avatar=False)
    data = mujoco.MjData(house_scene.model)
    mujoco.mj_forward(house_scene.model, data)
    rng, field, count = np.random.default_rng(5), FieldOfView(2.6, 2.0, 9.0), 0
    for _ in range(60):
        eye = np.array([*navmesh.sample(rng), rng.uniform(0.3, 1.7)])
        seen = visible_objects(house_scene, data, eye, 0.0, field=field)
        assert set(seen) == _seen_by_every_ray(house_scene, data, eye, field)
        some = house_scene.index.names[::2]
        among = visible_objects(house_scene, data, eye, 0.0, field=field, among=some)
        assert among == tuple(name for name in seen if name in some)
        count += len(seen)
    assert count > 60


def test_agrees_with_dense_rays(scene: Scene, navmesh: NavMesh) -> None:
    """From anywhere in the apartment: no false sight, and what is mostly in the open is seen."""
    data = mujoco.MjData(scene.model)
    mujoco.mj_forward(scene.model, data)
    alone = scene.model.__copy__()
    rng = np.random.default_rng(2)
    field = USUAL
    seen_count = open_count = 0
    for _ in range(30):
        eye = np.array([*navmesh.sample(rng), EYE_HEIGHT])
        heading, pitch = rng.uniform(-math.pi, math.pi), rng.uniform(-0.7, 0.0)
        seen = visible_objects(scene, data, eye, heading, pitch)
        for name in scene.index.names:
            x, y, z = data.xpos[scene.index.body(name)] - eye
            bearing = (math.atan2(y, x) - heading + math.pi) % (2 * math.pi) - math.pi
            elevation = math.atan2(z, math.hypot(x, y)) - pitch
            distance = math.sqrt(x * x + y * y + z * z)
            if name in seen:
                seen_count += 1
                assert abs(bearing) < field.horizontal / 2 + 0.25
                assert _unblocked_share(scene, data, alone, eye, name) > 0
            elif abs(bearing) < 0.45 and abs(elevation) < 0.4 and distance < 7.7:
                assert _unblocked_share(scene, data, alone, eye, name) < 0.7, (name, eye)
                open_count += 1
    assert seen_count > 20
    assert open_count > 20
