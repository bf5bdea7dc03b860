"""Two carried loads: the right one passes above the left one, because side by side they would catch on each other."""

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
