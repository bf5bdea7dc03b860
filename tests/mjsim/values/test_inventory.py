"""The knapsack of capacity two."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjsim.values.errors import ActionError
from mjsim.values.inventory import LEFT, RIGHT, Inventory


def test_take_and_release():
    both = Inventory().take(RIGHT, "mug").take(LEFT, "book")
    assert both.hands == ("book", "mug")
    assert both.carried == ("book", "mug")
    assert both.free_hands == ()
    assert both.hand_of("mug") == RIGHT
    assert both.hand_of("duck") is None
    assert both.release("book") == Inventory(right="mug")


def test_impossible_changes_are_named():
    held = Inventory(left="mug")
    with pytest.raises(ActionError, match="already holds 'mug'"):
        held.take(LEFT, "book")
    with pytest.raises(ActionError, match="both hands cannot hold 'mug'"):
        held.take(RIGHT, "mug")
    with pytest.raises(ActionError, match="no hand holds 'book'"):
        held.release("book")


@given(st.lists(st.tuples(st.sampled_from([LEFT, RIGHT]), st.sampled_from("abcd")), max_size=20))
def test_behaves_as_a_set_of_at_most_two(changes):
    inventory, model = Inventory(), set[str]()
    for hand, name in changes:
        if name in model:
            inventory, model = inventory.release(name), model - {name}
        elif inventory.hands[hand] is None:
            inventory, model = inventory.take(hand, name), model | {name}
        assert set(inventory.carried) == model
        assert len(inventory.free_hands) == 2 - len(model)
