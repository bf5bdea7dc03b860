"""Seeing by rays: walls and objects block, the field of view has edges, and a dense oracle agrees."""

import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from small_worlds import scene_of

from mjsim.house.scene.scene import compose
from mjsim.house.sight.sight import OFFSETS, FieldOfView, visible_objects
from mjsim.render import CameraPose, Labels, Renderer
from mjsim.values.person_parameters import PersonParameters

EYE_HEIGHT = 1.6
USUAL = FieldOfView.of(PersonParameters())


def _stand(catalogue, placed, eye, heading, *, avatar=False):
    """The small house and a person below the eye."""
    scene = scene_of(catalogue, (*eye[:2], heading), *placed, names="{model}_{i}", avatar=avatar)
    data = mujoco.MjData(scene.model)
    mujoco.mj_forward(scene.model, data)
    return scene, data


def _look(catalogue, placed, eye, heading, pitch=0.0, field=None, *, avatar=False):
    scene, data = _stand(catalogue, placed, eye, heading, avatar=avatar)
    return visible_objects(scene, data, eye, heading, pitch, field=field)


def test_walls_block_and_doorways_do_not(small_catalogue):
    eye = (1.5, 2.0, EYE_HEIGHT)
    down = -0.35
    assert _look(small_catalogue, [("cube", 5.0, 2.0)], eye, 0.0, down) == ("cube_0",)
    assert _look(small_catalogue, [("cube", 5.0, 0.5)], eye, -0.4, down) == ()


def test_other_objects_block(small_catalogue):
    eye, behind = (0.5, 1.0, 0.05), ("ball", 2.0, 1.0)
    assert _look(small_catalogue, [("cube", 1.0, 1.0), behind], eye, 0.0) == ("cube_0",)
    assert _look(small_catalogue, [("cube", 1.0, 1.4), behind], eye, 0.0) == ("cube_0", "ball_1")


def test_objects_in_a_receptacle_are_seen_from_above_only(small_catalogue):
    crate = [("cube", 0.3, 3.7)]
    near = (0.9, 3.1, EYE_HEIGHT)
    assert _look(small_catalogue, crate, near, 2.356, -1.1) == ("cube_0",)
    assert _look(small_catalogue, crate, (1.5, 2.5, 0.1), 2.356, 0.0) == ()


def test_own_body_does_not_block(small_catalogue):
    args = (small_catalogue, [("cube", 1.6, 1.0)], (1.0, 1.0, EYE_HEIGHT), 0.0, -1.1)
    assert _look(*args, avatar=True) == _look(*args) == ("cube_0",)


@pytest.mark.parametrize("hand", ["left", "right"])
def test_own_hands_do_not_block(small_catalogue, hand):
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
def test_edges_of_the_field(small_catalogue, sign):
    """The cube is at a known bearing; fields just wide and just narrow enough for it."""
    eye, cube = (0.5, 2.0, 0.05), [("cube", 2.5, 2.0)]
    half = math.atan(0.05 / 1.95)  # of the cube as seen
    off = math.radians(30)
    wide, narrow = 2 * (off + half), 2 * (off - half)
    for axis in ("horizontal", "vertical"):
        turn = {"horizontal": (sign * off, 0.0), "vertical": (0.0, sign * off)}[axis]
        assert _look(small_catalogue, cube, eye, *turn, replace(USUAL, **{axis: wide})) == ("cube_0",)
        assert _look(small_catalogue, cube, eye, *turn, replace(USUAL, **{axis: narrow})) == ()


def _seen_by_every_ray(scene, data, eye, field):
    """Objects in view along +x, in the episode's order, with every ray cast and no culling."""
    model, owner, groups = scene.model, scene.index.geom_owner, np.array([1, 1, 1, 0, 0, 0], np.uint8)
    seen, geom = {}, np.zeros(1, np.int32)
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
                    seen[name] = True
    return tuple(seen)


def test_culling_changes_no_answer(episode, catalogue, navmesh):
    """Field of view, occluders and early exits save rays; what is seen is what all rays together meet."""
    house_scene = compose(episode, catalogue, avatar=False)
    data = mujoco.MjData(house_scene.model)
    mujoco.mj_forward(house_scene.model, data)
    rng, field, count = np.random.default_rng(5), FieldOfView(2.6, 2.0, 9.0), 0
    for _ in range(60):
        eye = np.array([*navmesh.sample(rng), rng.uniform(0.3, 1.7)])
        seen = visible_objects(house_scene, data, eye, 0.0, field=field)
        assert seen == _seen_by_every_ray(house_scene, data, eye, field)
        some = house_scene.index.names[::2]
        among = visible_objects(house_scene, data, eye, 0.0, field=field, among=some)
        assert among == tuple(name for name in seen if name in some)
        count += len(seen)
    assert count > 60


@pytest.mark.slow
def test_what_is_seen_is_what_a_picture_shows(scene, navmesh):
    """From anywhere in the apartment: nothing that no pixel shows, and all that is near and not a speck."""
    data = mujoco.MjData(scene.model)
    mujoco.mj_forward(scene.model, data)
    labels, rng, count = Labels.of(scene), np.random.default_rng(2), 0
    with Renderer(scene.model, width=640, height=480) as renderer:
        for _ in range(40):
            eye = np.array([*navmesh.sample(rng), EYE_HEIGHT])
            heading, pitch = rng.uniform(-math.pi, math.pi), rng.uniform(-0.7, 0.0)
            ahead = np.array([math.cos(heading), math.sin(heading), math.tan(pitch)])
            pose = CameraPose.looking_at(eye, eye + ahead, USUAL.vertical)
            pixels = labels.pixel_counts(renderer.segmentation(data, pose))
            seen = visible_objects(scene, data, eye, heading, pitch)
            assert set(seen) <= set(pixels)
            for name in set(scene.index.names) - set(seen):
                near = math.dist(eye, data.xpos[scene.index.body(name)]) < USUAL.range - 0.3
                assert not near or pixels.get(name, 0) < 50, (name, eye)
            count += len(seen)
    assert count > 50
