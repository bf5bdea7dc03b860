"""The hands, the statuses and the events of an episode, which both levels of fidelity share."""

import numpy as np
import pytest
from small_worlds import scene_of

from mjsim.house.scene import avatar
from mjsim.house.scene.avatar import LEFT, RIGHT
from mjsim.values.actions import EventKind, WorldEvent
from mjsim.values.errors import StateError
from mjsim.values.observation import ObjectStatus
from mjsim.world.fidelity.tier import EpisodeState
from mjsim.world.state import StateDetails

LOOSE, CARRIED, DELIVERED = ObjectStatus.LOOSE, ObjectStatus.CARRIED, ObjectStatus.DELIVERED
PLACED = (("cube", 1.6, 2.4), ("wedge", 1.3, 1.5), ("ball", 2.2, 3.0))


@pytest.fixture(scope="module")
def scene(small_catalogue):
    return scene_of(small_catalogue, (1.0, 2.0, 0.3), *PLACED)


@pytest.fixture
def state(scene):
    return EpisodeState(scene)


def test_each_event_changes_the_hands_and_the_status_and_is_reported_with_its_time(state):
    state.picked(1.0, RIGHT, 1, True)
    assert (state.held, state.status) == ([None, 1], [LOOSE, CARRIED, LOOSE])
    state.picked(2.0, LEFT, 0, False)
    assert (state.held, state.status) == ([None, 1], [LOOSE, CARRIED, LOOSE])
    state.picked(3.0, LEFT, 2, True)
    state.lost(4.0, 2)
    assert (state.held, state.status) == ([None, 1], [LOOSE, CARRIED, LOOSE])
    state.placed(5.0, 1, "crate", True)
    assert (state.held, state.status) == ([None, None], [LOOSE, DELIVERED, LOOSE])
    state.dislodged(6.0, 1)
    assert state.status == [LOOSE] * 3
    state.picked(7.0, LEFT, 0, True)
    state.placed(8.0, 0, "crate", False)
    assert (state.held, state.status) == ([None, None], [LOOSE] * 3)
    assert state.events == [
        WorldEvent(1.0, EventKind.PICKED, "o1", None),
        WorldEvent(2.0, EventKind.PICK_FAILED, "o0", None),
        WorldEvent(3.0, EventKind.PICKED, "o2", None),
        WorldEvent(4.0, EventKind.GRIP_LOST, "o2", None),
        WorldEvent(5.0, EventKind.PLACED, "o1", "crate"),
        WorldEvent(6.0, EventKind.DISLODGED, "o1", "crate"),
        WorldEvent(7.0, EventKind.PICKED, "o0", None),
        WorldEvent(8.0, EventKind.PLACE_FAILED, "o0", "crate"),
    ]
    state.picked(9.0, LEFT, 0, True)
    held = state.held
    state.reset()
    assert (state.held, state.status, state.events) == ([None, None], [LOOSE] * 3, [])
    assert state.held is held, "the person shares this list"


def test_an_observation_holds_the_values_it_is_made_of(scene, state):
    state.picked(1.0, LEFT, 2, True)
    places, turns = np.arange(9.0).reshape(3, 3), np.tile([1.0, 0.0, 0.0, 0.0], (3, 1))
    velocity = np.array([0.4, -0.5])
    seen = state.observation(7.5, np.array([1.1, 2.2, 0.7, -0.3]), velocity, (places, turns), busy=True)
    velocity[:] = 9.0
    assert (seen.time, seen.heading, seen.pitch, seen.busy) == (7.5, 0.7, -0.3, True)
    assert seen.position.tolist() == [1.1, 2.2] and seen.velocity.tolist() == [0.4, -0.5]
    ahead = avatar.EYE_FORWARD * np.cos(-0.3)
    assert seen.eye[:2] == pytest.approx([1.1 + ahead * np.cos(0.7), 2.2 + ahead * np.sin(0.7)])
    assert seen.eye[2] == pytest.approx(scene.person.eye_height + avatar.EYE_FORWARD * np.sin(-0.3))
    assert seen.object_names == ("o0", "o1", "o2") and seen.hands == ("o2", None)
    assert seen.object_status == (LOOSE, LOOSE, CARRIED)
    assert (seen.object_positions == places).all() and (seen.object_quaternions == turns).all()


def test_a_state_is_restored_and_one_of_other_objects_is_refused(state):
    health = object()  # the monitor restores it
    state.picked(1.0, RIGHT, 1, True)
    details = state.details(health)
    assert (details.hands, details.status) == ((None, "o1"), (LOOSE, CARRIED, LOOSE))
    assert details.health is health and details.person is None
    state.picked(2.0, LEFT, 0, True)
    held = state.held
    state.restore(details)
    assert (state.held, state.status, state.events) == ([None, 1], [LOOSE, CARRIED, LOOSE], [])
    assert state.held is held, "the person shares this list"
    for hands, count in (((None, "o1"), 2), ((None, "o1"), 4), (("o7", None), 3), (("o1", "o1"), 3)):
        with pytest.raises(StateError, match="take it from a world of the same episode"):
            state.restore(StateDetails(hands, (LOOSE,) * count, health, None))
    assert state.held == [None, 1], "a state that was refused changes nothing"
    state.restore(StateDetails(("o2", "o0"), (CARRIED, DELIVERED, CARRIED), health, None))
    assert (state.held, state.status) == ([2, 0], [CARRIED, DELIVERED, CARRIED])
