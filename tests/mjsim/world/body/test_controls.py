"""From keys, mouse and gamepad to actions."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from experiments.house import House
from experiments.web.controls import MAX_PITCH, MAX_PRESSES, PRESS_LIFE, Controls, Input, control_step
from mjsim.house.scene.scene import compose
from mjsim.values.actions import IDLE, ActionResult, Move, Pick, Place, Refusal
from mjsim.values.options import WorldOptions
from mjsim.values.person_parameters import PersonParameters
from mjsim.world.world import World

OPTIONS = WorldOptions(fidelity="event")
PERSON = PersonParameters()
SHARE = st.floats(-1.0, 1.0)
INPUTS = st.lists(
    st.builds(
        Input,
        number=st.just(1),
        forward=SHARE,
        left=SHARE,
        turn=st.sampled_from((0.0, 0.0, -1.0, 0.5)),
        look=st.sampled_from((0.0, 0.0, 1.0)),
        yaw=st.floats(-7.0, 7.0),
        pitch=st.floats(-7.0, 7.0),
    ),
    max_size=4,
)


@pytest.fixture(scope="module")
def scene():
    house = House.load()
    return compose(house.sample_episode(objects=6, seed=0), house.catalogue)


def nothing(action):
    return ActionResult(action, Refusal.NOTHING_IN_REACH)


def steps(world, seen, controls, *batches, answer=nothing):
    """Actions for batches of inputs, one batch a control step."""
    actions = []
    for inputs in batches:
        action, controls = control_step(controls, inputs, seen, answer, PERSON, world.control_timestep)
        seen = world.step(action).observation
        actions.append(action)
    return actions, controls, seen


def test_a_tap_between_two_control_steps_counts_for_one(scene):
    world = World(scene, OPTIONS)
    tap = (Input(number=1, forward=1.0), Input(number=2))
    actions, *_ = steps(world, world.reset(), Controls(), tap, ())
    assert actions == [Move(forward=PERSON.walking_speed), IDLE]


def test_a_key_that_is_held_down_counts_until_it_is_released(scene):
    world = World(scene, OPTIONS)
    actions, *_ = steps(
        world, world.reset(), Controls(), (Input(number=1, left=-1.0),), (), (), (Input(number=2),), ()
    )
    assert [a.left for a in actions] == [-PERSON.walking_speed] * 3 + [0.0, 0.0]


def test_walking_diagonally_is_not_faster(scene):
    world = World(scene, OPTIONS)
    (action,), *_ = steps(world, world.reset(), Controls(), (Input(number=1, forward=1.0, left=1.0),))
    assert math.hypot(action.forward, action.left) == pytest.approx(PERSON.walking_speed)


@pytest.mark.parametrize("yaw", [-2.5, -0.3, 0.02, 1.0, 2.5])
def test_the_body_turns_to_where_the_mouse_points_within_its_limits(scene, yaw):
    world = World(scene, OPTIONS)
    seen = world.reset()
    target = seen.heading + yaw
    actions, _, seen = steps(world, seen, Controls(), (Input(number=1, yaw=yaw),), *[()] * 60)
    assert math.cos(seen.heading - target) == pytest.approx(1.0, abs=1e-3)
    assert all(abs(a.turn) <= PERSON.turning_speed for a in actions)


@pytest.mark.slow
@settings(max_examples=100, deadline=None)
@given(st.lists(INPUTS, min_size=1, max_size=6))
def test_no_input_exceeds_the_limits(scene, batches):
    world = World(scene, OPTIONS)
    actions, controls, _ = steps(world, world.reset(), Controls(), *batches)
    for action in actions:
        assert math.hypot(action.forward, action.left) <= PERSON.walking_speed * (1 + 1e-12)
        assert abs(action.turn) <= PERSON.turning_speed and abs(action.look) <= PERSON.looking_speed
    assert controls.pitch is None or abs(controls.pitch) <= MAX_PITCH


def test_presses_that_wait_are_few_and_short_lived(scene):
    world = World(scene, OPTIONS)
    seen = world.reset()
    flood = Controls().take([Input(number=1, press="act")] * 64, seen)
    assert len(flood.presses) == MAX_PRESSES
    old = Controls(presses=(("act", 0.0), ("left hand", PRESS_LIFE), ("right hand", 0.0)))
    _, controls = control_step(old, (), seen, nothing, PERSON, world.control_timestep)
    assert [press for press, _ in controls.presses] == ["right hand"]


def pressed(key, answers, hands=(None, None)):
    class Seen:
        heading = pitch = 0.0

    Seen.hands = hands
    press = (Input(number=1, press=key),)
    action, controls = control_step(Controls(), press, Seen, lambda a: answers[type(a)], PERSON, 0.04)
    assert controls.presses == ()
    return action


PLACE, PICK = ActionResult(Place(), None, "mug", "dish_bin"), ActionResult(Pick(), None, "duck")
NO_PLACE = ActionResult(Place(), Refusal.HANDS_EMPTY)
NO_PICK = ActionResult(Pick(), Refusal.NOTHING_IN_REACH)
WRONG = ActionResult(Place(), Refusal.NOT_THE_RECEPTACLE, "mug", "toy_box")


@pytest.mark.parametrize(
    ("place", "pick", "chosen"),
    [
        (PLACE, PICK, Place()),  # where both are possible, placing wins
        (PLACE, NO_PICK, Place()),
        (NO_PLACE, PICK, Pick()),
        (WRONG, PICK, Pick()),
        (WRONG, NO_PICK, Place()),  # so that the message says where it belongs
        (NO_PLACE, NO_PICK, Pick()),
    ],
)
def test_the_action_key(place, pick, chosen):
    assert pressed("act", {Place: place, Pick: pick}) == chosen


def test_the_keys_of_the_hands():
    answers = {Place: PLACE, Pick: PICK}
    assert pressed("left hand", answers, ("mug", "duck")) == Place("mug")
    assert pressed("right hand", answers, ("mug", "duck")) == Place("duck")
    assert pressed("left hand", answers, (None, "duck")) == Pick()


def test_keys_pressed_within_one_control_step_are_acted_on_one_after_the_other(scene):
    world = World(scene, OPTIONS)
    both = (Input(number=1, press="act"), Input(number=2, press="left hand"))
    actions, *_ = steps(world, world.reset(), Controls(), both, (), ())
    assert actions == [Pick(), Pick(), IDLE]
