"""Bounding volumes of the house: a better tree over the same geoms changes no contact and no ray."""

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mjsim.house.compiled.bounding_volumes import surface_area_tree, tighten
from mjsim.house.compiled.house import compiled_house


def _cluttered(seed, moving):
    """Boxes of all sizes in a pit, and spheres above it."""
    rng = np.random.default_rng(seed)
    spec = mujoco.MjSpec()
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1])
    for _ in range(60):
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=rng.uniform((-2, -2, 0), (2, 2, 0.5)),
            quat=rng.normal(size=4),
            size=rng.choice([0.05, 0.1, 0.8], size=3),
        )
    for number in range(moving):
        body = spec.worldbody.add_body(name=f"ball{number}", pos=rng.uniform((-2, -2, 1.5), (2, 2, 2.5)))
        body.add_freejoint()
        for _ in range(3):
            body.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.1, 0, 0], pos=rng.normal(0, 0.1, 3))
    return spec


@pytest.mark.parametrize("seed", range(3))
def test_contacts_stay_bit_identical(seed):
    plain, tight = (_cluttered(seed, 5).compile() for _ in range(2))
    tighten(tight)
    assert not np.array_equal(plain.bvh_child, tight.bvh_child)
    states = []
    for model in (plain, tight):
        data = mujoco.MjData(model)
        mujoco.mj_step(model, data, 400)
        states.append((data.qpos.copy(), data.ncon, data.contact.geom.copy(), data.contact.dist.copy()))
    assert states[0][1] > 1
    for mine, other in zip(*states, strict=True):
        np.testing.assert_array_equal(mine, other)


@pytest.mark.parametrize("seed", range(3))
def test_rays_hit_the_same(seed):
    rng = np.random.default_rng(seed)
    plain, tight = (_cluttered(seed, 1).compile() for _ in range(2))
    tighten(tight)
    starts, ways = rng.uniform((-2, -2, 1), (2, 2, 2), (100, 3)), rng.normal(size=(100, 3))
    hits = []
    for model in (plain, tight):
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        geom = np.zeros(1, np.int32)
        hits.append(
            [
                (mujoco.mj_ray(model, data, a, b, None, 1, -1, geom), int(geom[0]))
                for a, b in zip(starts, ways, strict=True)
            ]
        )
    assert hits[0] == hits[1]
    assert sum(geom >= 0 for _, geom in hits[0]) > 30


def _touched(model, low, high):
    """How many nodes of the world's tree a search for a box visits."""
    first, stack, visited = int(model.body_bvhadr[0]), [0], 0
    while stack:
        node = first + stack.pop()
        visited += 1
        center, half = model.bvh_aabb[node, :3], model.bvh_aabb[node, 3:]
        if np.any(center + half < low) or np.any(center - half > high):
            continue
        stack += [child for child in model.bvh_child[node].tolist() if child >= 0]
    return visited


def test_the_house_is_searched_in_two_thirds_of_the_tests(catalogue):
    spec = compiled_house(catalogue).spec()
    plain, tight = spec.compile(), spec.compile()
    tighten(tight)
    places = np.random.default_rng(0).uniform((0, 0, 0.5), (12, 10, 1.5), (300, 3))
    counts = [sum(_touched(model, at - 0.2, at + 0.2) for at in places) for model in (plain, tight)]
    assert counts[1] < 0.67 * counts[0]


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 60), st.integers(0, 2**31))
def test_every_box_is_one_leaf_and_lies_in_all_nodes_above(count, seed):
    rng = np.random.default_rng(seed)
    low = rng.integers(0, 8, (count, 3)).astype(float)  # many ties
    high = low + rng.integers(0, 4, (count, 3))
    boxes, children, leaf, depth = surface_area_tree(low, high)
    assert sorted(leaf[leaf >= 0].tolist()) == list(range(count))
    assert len(boxes) == 2 * count - 1

    def members(node):
        found = [int(leaf[node])] if leaf[node] >= 0 else []
        for child in children[node][children[node] >= 0]:
            assert depth[child] == depth[node] + 1
            found += members(int(child))
        inside = np.array(found)
        np.testing.assert_allclose(boxes[node, :3] - boxes[node, 3:], low[inside].min(axis=0))
        np.testing.assert_allclose(boxes[node, :3] + boxes[node, 3:], high[inside].max(axis=0))
        return found

    assert len(members(0)) == count
