"""The state of a world as a value: complete, exact, and hashed."""

import dataclasses

import mujoco
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from small_worlds import do, finish, scene_of

from mjsim.house.scene.scene import compose
from mjsim.values.actions import Pick
from mjsim.values.errors import StateError
from mjsim.world.state import StateHash, WorldState, engine_versions, model_fingerprint
from mjsim.world.world import World

FEW = settings(
    max_examples=15,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)


@pytest.fixture(scope="module")
def world(small_catalogue):
    return World(scene_of(small_catalogue, (1.0, 1.0, 0.0), ("cube", 1.6, 1.3)))


def test_a_state_does_not_change_when_the_world_goes_on(world):
    world.reset()
    state = world.state()
    before = state.hash
    world.restore(state)
    do(world, Pick())
    assert state.hash == before
    assert world.state().hash != before


def test_a_busy_world_has_no_state(world):
    world.reset()
    world.step(Pick())
    with pytest.raises(StateError, match=r"busy at t = .* take its state between motions"):
        world.state()
    finish(world)
    world.state()


@pytest.mark.parametrize("details", ["{}", "[]", "{", '{"health": {"altitude": 3}}'])
def test_details_of_something_else_are_refused(details):
    with pytest.raises(StateError, match="details do not fit"):
        WorldState.from_json(np.zeros(1), details)


def with_details(state, person=(), **changes):
    person = dataclasses.replace(state.details.person, **dict(person))
    return WorldState(state.physics, dataclasses.replace(state.details, person=person, **changes))


def with_a_hole(state):
    state.physics[3] = np.nan
    return state


DAMAGES = {
    "no numbers": (lambda s: WorldState(np.zeros(0), s.details), "a state of 0 numbers"),
    "another scene": (lambda s: WorldState(np.zeros(7), s.details), "a state of 7 numbers"),
    "not finite": (with_a_hole, "1 of them not finite"),
    "another rig": (
        lambda s: with_details(s, {"rig": dataclasses.replace(s.details.person.rig, motion=np.zeros(3))}),
        "details do not fit",
    ),
    "another grip": (lambda s: with_details(s, {"grips": ((99, 0), None)}), "details do not fit"),
    "an object less": (lambda s: with_details(s, status=s.details.status[1:]), "same episode"),
    "another object": (lambda s: with_details(s, hands=("nobody's", None)), "same episode"),
    "one object in both hands": (lambda s: with_details(s, hands=("o0", "o0")), "same episode"),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_state_that_does_not_fit_is_refused(world, damage):
    make, message = DAMAGES[damage]
    world.reset()
    with pytest.raises(StateError, match=message):
        world.restore(make(world.state()))
    world.reset()


@FEW
@given(field=st.sampled_from(["qpos", "qvel", "ctrl", "eq_active", "time"]), data=st.data())
def test_the_hash_tells_states_apart_by_the_last_bit(scene, field, data):
    physics = mujoco.MjData(scene.model)
    hasher = StateHash(scene.model)
    before = hasher.of(physics)
    if field == "time":
        physics.time = np.nextafter(physics.time, 1.0)
    else:
        values = getattr(physics, field)
        place = data.draw(st.integers(0, len(values) - 1))
        values[place] = 1 if field == "eq_active" else np.nextafter(values[place], 9.0)
    assert hasher.of(physics) != before
    mujoco.mj_resetData(scene.model, physics)
    assert hasher.of(physics) == before


def test_the_fingerprint_is_of_what_moves_not_of_looks(episode, catalogue):
    models = [compose(episode, catalogue).model for _ in range(2)]
    before = model_fingerprint(models[0])
    assert model_fingerprint(models[1]) == before
    models[0].geom_rgba[:] = 0.5
    models[0].tex_data[:] = 0
    models[0].mat_specular[:] = 0.0
    assert model_fingerprint(models[0]) == before
    for name in ("body_mass", "geom_friction", "mesh_vert", "dof_damping", "geom_pos", "eq_solref"):
        values = getattr(models[0], name).reshape(-1)
        kept, values[-1] = float(values[-1]), np.nextafter(values[-1], 9.0, dtype=values.dtype)
        assert model_fingerprint(models[0]) != before, name
        values[-1] = kept
    assert model_fingerprint(models[0]) == before
    models[0].opt.impratio = 9.0
    assert model_fingerprint(models[0]) != before


def test_versions_name_the_engine():
    versions = engine_versions()
    assert versions["mujoco"] == mujoco.__version__
    assert all(isinstance(value, str) and value for value in versions.values())
