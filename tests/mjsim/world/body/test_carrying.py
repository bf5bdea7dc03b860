"""Carried loads: the right one passes above the left one, and a hand presses only gently on an obstacle."""

import numpy as np
import pytest
from small_worlds import do, scene_of, world_of

from mjsim.house.scene import avatar
from mjsim.values.actions import Pick


@pytest.mark.parametrize(("apart", "rises"), [(0.05, True), (0.5, False)])
def test_the_right_load_rises_while_the_hands_pass_each_other(small_catalogue, apart, rises):
    """The postures of the hands are far apart, so only the way between them is narrow."""
    placed = ("cube", 2.0, 2.3), ("ball", 2.0, 1.7)
    world = world_of(scene_of(small_catalogue, (1.5, 2.0, 0.0), *placed, height=0.001))
    do(world, Pick("o0"))
    do(world, Pick("o1"))
    person, carrying = world._tier.person, world._tier.carrying
    for _ in range(50):
        carrying.update(avatar.CARRY)
    person.rig.hand_targets[:, 1] = 0.5 * apart, -0.5 * apart
    person.hand_velocities[:] = 0.0
    carrying.update(avatar.CARRY)
    assert (person.hand_velocities[1, 2] > 0.01) == rises
    assert abs(person.hand_velocities[0, 2]) < 0.01


def divisions(person, monkeypatch):
    """Division of the physics steps in each control step, and whether the right hand's grip is firm."""
    found, advance = [], person.rig.advance

    def recorded(division):
        found.append((division, person.grips.is_firm(avatar.RIGHT)))
        advance(division)

    monkeypatch.setattr(person.rig, "advance", recorded)
    return found


def test_steps_are_short_while_a_grip_that_became_firm_pulls_its_object_in(small_catalogue, monkeypatch):
    """Otherwise, an object that touches its shelf is thrown away from the shelf at 10 m/s."""
    world = world_of(scene_of(small_catalogue, (1.5, 2.0, 0.0), ("cube", 2.0, 1.8), height=0.001))
    found = divisions(world._tier.person, monkeypatch)
    do(world, Pick("o0"))
    firm = [division for division, is_firm in found if is_firm]
    assert firm[0] > 1 and firm[-1] == 1


@pytest.mark.parametrize(("distance", "is_caught"), [(0.05, False), (0.2, True)])
def test_steps_are_short_while_furniture_holds_a_load_back(small_catalogue, monkeypatch, distance, is_caught):
    world = world_of(scene_of(small_catalogue, (1.5, 2.0, 0.0), ("cube", 2.0, 1.8), height=0.001))
    do(world, Pick("o0"))
    person = world._tier.person
    found = divisions(person, monkeypatch)
    person.rig.hand_targets[avatar.RIGHT, 1] -= distance
    person.advance()
    assert (found[0][0] > 1) == is_caught


@pytest.mark.parametrize("blocked", [True, False])
def test_a_hand_whose_load_an_obstacle_stops_hardly_presses_on_it_so_that_it_can_slide_past(
    small_catalogue, monkeypatch, blocked
):
    world = world_of(scene_of(small_catalogue, (1.5, 2.0, 0.0), ("cube", 2.0, 2.0), height=0.001))
    do(world, Pick("o0"))
    person, carrying = world._tier.person, world._tier.carrying
    hand, scene = person.held.index(0), world.scene
    wall = int(np.flatnonzero(carrying._owners == -1)[0])
    geoms = np.array([[scene.index.geoms("o0")[0], wall]], np.int32)
    frames = np.eye(3).reshape(1, 9)  # The obstacle is ahead, because the normal points from the load to it.
    contacts = geoms, frames, carrying._owners
    monkeypatch.setattr(carrying, "_contacts", lambda: contacts if blocked else carrying._no_contacts)
    person.rig.hand_targets[hand, :2] = person.rig.hands[hand, :2] + 0.1
    carrying.update(avatar.CARRY)
    ahead, aside = (person.rig.hand_targets - person.rig.hands)[hand, :2]
    assert (ahead < 0.02) == blocked
    assert aside > 0.08


@pytest.mark.parametrize(("yields", "seconds"), [(0.5, None), (1.0, 2.5)])
def test_a_load_that_furniture_holds_for_seconds_slips_out_of_the_hand(small_catalogue, yields, seconds):
    """Otherwise, a person whose load is caught between furniture could neither walk nor turn any more."""
    world = world_of(scene_of(small_catalogue, (1.5, 2.0, 0.0), ("cube", 2.0, 1.8), height=0.001))
    do(world, Pick("o0"))
    person, carrying = world._tier.person, world._tier.carrying
    carrying._compliance[avatar.RIGHT] = yields * person.parameters.carrying.most_compliance, 0.0
    steps = next((k for k in range(200) if carrying.slipped() == (avatar.RIGHT,)), None)
    if seconds is None:
        assert steps is None
    else:
        assert steps * person.dt == pytest.approx(seconds, rel=0.1)
