"""The vectors of an observation against plain NumPy, in random states of the apartment and of a generated home."""

import dataclasses
import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

import mjsim
from mjsim import ObjectStatus
from mjsim.environments.sensors import BUNDLES
from mjsim.environments.sensors.vector_kernels import RANGE, RAYS


def oracle(inputs):
    """All vectors, array by array."""
    layout, state, scene, start = inputs.layout, inputs.state, inputs.world.scene, inputs.start
    x_min, y_min, x_max, y_max = layout.floor.bounds
    slots, scale = layout.slots, math.dist((x_min, y_min), (x_max, y_max))

    def rotated(vectors, angle):
        c, s = np.cos(angle), np.sin(angle)
        return vectors @ np.array([[c, s], [-s, c]])

    def offsets(points):
        return rotated(points - state.position, -state.heading) / scale

    def padded(rows):
        return np.concatenate([rows, np.zeros((slots - len(rows), *np.shape(rows)[1:]))])

    names, statuses = state.object_names, np.array([list(ObjectStatus).index(s) for s in state.object_status])
    bins = np.array([scene.receptacles[scene.episode.targets[n]].center[:2] for n in names])
    goals = np.where(statuses[:, None] == 0, state.object_positions[:, :2], bins)
    q, centres = state.object_quaternions, state.object_positions
    vectors = {
        "gps": rotated(state.position - (start.x, start.y), -start.heading) / scale,
        "compass": rotated(np.array([1.0, 0.0]), state.heading - start.heading),
        "pose": [
            (2 * state.position[0] - x_min - x_max) / (x_max - x_min),
            (2 * state.position[1] - y_min - y_max) / (y_max - y_min),
            math.cos(state.heading),
            math.sin(state.heading),
        ],
        "motion": [
            *rotated(state.velocity, -state.heading) / layout.max_speed,
            state.pitch / (math.pi / 2),
            state.busy,
        ],
        "inventory": [[j < len(names) and hand == names[j] for j in range(slots)] for hand in state.hands],
        "rangefinder": ranges(layout.floor.obstacles, state.position, state.heading) / RANGE,
        "receptacles": offsets(np.array([scene.receptacles[k].center[:2] for k in layout.receptacles])),
        "object_mask": np.arange(slots) < len(names),
        "object_positions": padded(np.column_stack([offsets(centres[:, :2]), centres[:, 2] / scale])),
        "object_rotations": padded(np.where(q[:, :1] < 0, -q, q) / np.linalg.norm(q, axis=1)[:, None]),
        "object_status": padded(np.eye(3)[statuses]),
        "object_categories": padded(
            [[o.category == key for key in layout.categories] for o in scene.episode.objects]
        ),
        "goals": padded(offsets(goals) * (statuses != 2)[:, None]),
        "remaining": [(statuses != 2).mean()],
        "time_left": [max(0.0, 1 - state.time / layout.time_limit)],
    }
    return {name: np.clip(np.array(vector, np.float64), -1.0, 1.0) for name, vector in vectors.items()}


def ranges(outlines, position, heading):
    """Distances to obstacles in all directions, of all edges, also of those that face away or are far away."""
    angles = heading + 2 * math.pi * np.arange(RAYS) / RAYS
    ray = np.column_stack([np.cos(angles), np.sin(angles)])[:, None]
    start = np.concatenate(outlines) - position
    edge = np.concatenate([np.roll(outline, -1, axis=0) - outline for outline in outlines])
    inwards = edge[:, 0] * start[:, 1] - edge[:, 1] * start[:, 0] > 0
    across = ray[..., 0] * edge[:, 1] - ray[..., 1] * edge[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        along = (start[:, 0] * edge[:, 1] - start[:, 1] * edge[:, 0]) / across
        share = (start[:, 0] * ray[..., 1] - start[:, 1] * ray[..., 0]) / across
    met = inwards & (along >= 0) & (share >= 0) & (share <= 1)
    return np.where(met, along, RANGE).min(axis=1, initial=RANGE)


def random_state(rng, core):
    """A state that need not be possible, with at most two objects in the hands."""
    state, bounds = core.state, core.layout.floor.bounds
    count = len(state.object_names)
    poses = np.column_stack(
        [rng.uniform((*bounds[:2], 0), (*bounds[2:], 2), (count, 3)), rng.normal(size=(count, 4))]
    )
    statuses = rng.choice([ObjectStatus.LOOSE, ObjectStatus.DELIVERED], count)
    held = rng.permutation(count)[: rng.integers(3)]
    statuses[held] = ObjectStatus.CARRIED
    hands = rng.permutation([*(state.object_names[i] for i in held), *[None] * (2 - len(held))])
    return dataclasses.replace(
        state,
        time=rng.uniform(0, 1.2 * core.layout.time_limit),
        position=rng.uniform(bounds[:2], bounds[2:]),
        heading=rng.uniform(-9, 9),
        pitch=rng.uniform(-1, 1),
        velocity=rng.uniform(-2, 2, 2),
        object_positions=poses[:, :3],
        object_quaternions=poses[:, 3:],
        object_status=tuple(statuses),
        hands=tuple(hands),
        busy=bool(rng.integers(2)),
    )


@pytest.mark.parametrize("house", ["apartment", pytest.param("generated:7?rooms=5", marks=pytest.mark.slow)])
def test_vectors_agree_with_numpy(house):
    env = mjsim.make(house=house, objects=5, slots=7, seed=0, observations=("state",))
    env.reset()
    rng = np.random.default_rng(0)
    for _ in range(40):
        inputs = env.core._sensor_input(random_state(rng, env.core))
        wanted = oracle(inputs)
        assert list(wanted) == [sensor.name for sensor in BUNDLES["state"]]
        for sensor in BUNDLES["state"]:
            found = sensor.read(inputs)
            assert found.dtype == np.float32
            assert_allclose(found, wanted[sensor.name], rtol=0, atol=1e-6, err_msg=sensor.name)
    env.close()


def test_arrays_of_different_observations_do_not_share_memory():
    env = mjsim.make(objects=2, seed=0, observations=("state", "map"))
    first = env.reset().observation
    kept = {name: array.copy() for name, array in first.items()}
    second = env.step(np.ones(4, np.float32)).observation
    for name, array in second.items():
        array[:] = 7
        assert (first[name] == kept[name]).all(), name
    third = env.step(np.ones(4, np.float32)).observation
    assert all((array <= 1).all() for array in third.values())
    env.close()
