"""Tests of the assistance conditions (PAPER section 5), their discovery, and the texts of the message bar."""

import dataclasses

import hud_sample as sample
import numpy as np
import pytest

from hud.compose import Compositor, compose
from hud.conditions import CONDITIONS, OPTIONS, condition
from hud.errors import ConditionError, HudError, MessageError, TaskViewError
from hud.lists import in_sentence
from hud.markers import breadcrumbs, flagpoles
from hud.messages import KINDS, fade, message
from hud.schema import from_dict, to_dict
from hud.state import HudState, InventorySlot, MessageKind
from hud.task import Alternative, KnownPlan, TaskStep
from mjsim.values.actions import EventKind, Refusal


def shown(name, view):
    return condition(name)(view)


def with_path(view, *points):
    """Return a view in which the path to the next step is replaced."""
    ahead = KnownPlan(view.plan, segment=view.segment, path=np.array(points), goal=view.goal)
    return dataclasses.replace(view, ahead=ahead)


def with_status(view, **status):
    objects = tuple(dataclasses.replace(o, status=status.get(o.name, o.status)) for o in view.objects)
    return dataclasses.replace(view, objects=objects)


@pytest.mark.parametrize("name", CONDITIONS)
def test_every_condition_returns_a_hud_state(name):
    assert isinstance(shown(name, sample.task(6)), HudState)


@pytest.mark.parametrize(
    ("name", "named"),
    [
        ("magic", r"'magic'.*highlight, none, optimal"),
        ("none-sparkle", r"'sparkle'.*minimap, pin, .*regret, .*xray"),
        ("magic-minimap", r"'magic'.*-minimap or -pin.* or -xray"),
        ("hud.nowhere:hud_state", "condition"),
        ("hud.builtin_conditions:missing", "condition"),
        ("hud.builtin_conditions:__doc__", "condition"),
        (":x", "condition"),
    ],
)
def test_an_unknown_name_is_refused_with_the_choices(name, named):
    with pytest.raises(ConditionError, match=named) as caught:
        condition(name)
    assert isinstance(caught.value, HudError)


@pytest.mark.parametrize("name", CONDITIONS)
def test_all_conditions_show_bins_hands_progress_clock_and_message(name):
    text = message("hands_full", sample.TEXTS)
    view = sample.task(12, steps=6, message=text, clock=12.5)
    state = shown(name, view)
    assert [(b.label, b.picture, b.place) for b in state.bins] == [
        (r.label, r.picture, f"{r.room}, {r.place}") for r in view.receptacles
    ]
    assert [slot.label for slot in state.inventory] == [view.object(name).label for name in view.hands]
    assert (state.delivered, state.total, state.clock, state.message) == (2, 12, 12.5, text)


def test_who_carries_one_object_has_one_hand_on_show():
    view = dataclasses.replace(sample.task(6), capacity=1)
    state = shown("none", view)
    assert state.inventory == (None, InventorySlot())
    assert from_dict(to_dict(state)) == state
    frame, two = sample.backdrop(640, 480), shown("none", sample.task(6))
    rect = Compositor({}, sample.TEXTS).layout(state, 640, 480).panels["inventory"]
    drawn, other = (compose(frame, s, {}, sample.TEXTS) for s in (state, two))
    middle = rect.x + rect.width // 2
    assert np.array_equal(drawn[rect.y :, rect.x : middle], frame[rect.y :, rect.x : middle])
    assert np.array_equal(drawn[:, middle:], other[:, middle:])


@pytest.mark.parametrize("name", ["none", "highlight"])
def test_lists_are_in_the_participants_order_with_what_was_picked_crossed_out_at_the_bottom(name):
    """Picked objects are sorted by the time of picking. A dropped object returns to its original place."""
    view = with_status(sample.task(6), object_04="delivered", object_01="carried")
    picks = ("object_04", "object_02", "object_01")
    steps = (*(("pick", picked) for picked in picks), ("place", "object_04"))
    for order in (view.order, view.order[::-1]):
        rows = shown(name, dataclasses.replace(view, order=order, steps_done=steps)).checklist
        waiting = [n for n in order if n not in ("object_04", "object_01")]
        assert [r.text for r in rows] == [view.object(n).label for n in (*waiting, "object_04", "object_01")]
        assert [r.done for r in rows] == [False] * 4 + [True] * 2
        assert [r.carried for r in rows] == [False] * 5 + [True]


def test_highlight_adds_the_room_of_what_lies_about():
    view = sample.task(24, steps=5)
    rooms = {o.label: o.room for o in view.objects}
    for row in shown("highlight", view).checklist:
        assert row.detail.startswith(rooms[row.text]) is not row.done


def test_optimal_keeps_the_order_in_which_steps_were_really_done():
    view = sample.task(6)
    deviated = dataclasses.replace(
        view, steps_done=(TaskStep("pick", "object_05"),), ahead=KnownPlan(view.plan[:3])
    )
    assert [r.text for r in shown("optimal", deviated).checklist] == [
        view.object(n).label for n in ("object_05", "object_00", "object_01", "object_00")
    ]


def test_optimal_shows_breadcrumbs_along_the_segment_and_the_flagpoles_of_highlight_and_nothing_else():
    view = with_path(sample.task(12, steps=5), [5.0, 5.0], [6.0, 6.0])
    state = shown("optimal", view)
    crumbs = tuple(m for m in state.markers if m.role == "breadcrumb")
    assert view.segment is not None and crumbs == breadcrumbs(view.segment, view.eye_height)
    assert crumbs and not any(m.x_ray for m in crumbs), "walls hide the path"
    assert state.markers == (*crumbs, *shown("highlight", view).markers)
    assert (state.pointer, state.minimap, state.rerouted) == (None, None, False)


def test_guided_is_optimal_with_its_options():
    view = dataclasses.replace(
        with_path(sample.task(12, steps=5), [5.0, 5.0], [9.0, 9.0]), camera=sample.camera(640, 480, yaw=3.0)
    )
    state = shown("guided", view)
    assert state == shown("optimal-reroute-rims-pin-pointer", view)
    assert state == shown("guided-pin-pointer-rims", view), "an option that is there already adds nothing"
    assert {m.role for m in state.markers} == {"breadcrumb", "rim", "goal", "flagpole"}
    assert state.pointer is not None and state.rerouted
    assert view.path is not None
    assert tuple(m for m in state.markers if m.role == "breadcrumb") == breadcrumbs(
        view.path, view.eye_height, 0.5
    )
    assert {"reroute", "rims", "pin", "pointer", "bins", "minimap", "regret", "xray"} == set(OPTIONS)


@pytest.mark.parametrize(
    "name",
    [
        "none-minimap",
        "none-regret",
        "highlight-regret",
        "optimal-regret",
        "none-reroute-rims",
        "highlight-reroute-rims",
    ],
)
def test_options_add_nothing_where_there_is_nothing_to_add(name):
    """The view has no map, no known regrets and no breadcrumbs."""
    view = with_path(sample.task(12, steps=5), [5.0, 5.0], [9.0, 9.0])
    assert shown(name, view) == shown(name.partition("-")[0], view)


def test_bins_pins_the_bins_of_what_is_in_the_hands():
    for steps in range(5):
        view = sample.task(12, steps=steps)
        carried = {view.object(name).receptacle for name in view.hands if name is not None}
        pins = {m.position[:2] for m in shown("none-bins", view).markers}
        assert pins == {view.receptacle(key).position[:2] for key in carried}


def test_the_pointer_is_shown_only_while_the_goal_is_out_of_view():
    view = sample.task(6, steps=0)
    away = dataclasses.replace(view, camera=sample.camera(640, 480, yaw=3.0))
    facing = dataclasses.replace(view, camera=sample.camera(640, 480, yaw=0.6))
    assert view.goal is not None and view.goal[0] < 0, "the goal is ahead on the left"
    assert shown("optimal-pointer", view).pointer is None
    assert shown("optimal-pointer", facing).pointer is None
    assert shown("optimal-pointer", away).pointer is not None


def planned(view, **known):
    return dataclasses.replace(view, ahead=KnownPlan(**known))


@pytest.mark.parametrize(
    ("change", "named"),
    [
        (lambda view: dataclasses.replace(view, order=("object_00",)), "order"),
        (lambda view: dataclasses.replace(view, hands=("ghost", None)), "ghost"),
        (lambda view: dataclasses.replace(view, steps_done=(("throw", "object_00"),)), "throw"),
        (lambda view: dataclasses.replace(view, receptacles=()), "dish_bin"),
        (lambda view: with_status(view, object_00="lost"), "lost"),
        # The plan is validated only when it is accessed.
        (lambda view: planned(view, steps=(TaskStep("pick", "ghost"),)).plan, "ghost"),
        (lambda view: planned(view, path=np.zeros((2, 3))).path, r"path.*\(2, 3\)"),
        (lambda view: planned(view, segment=np.zeros((2, 3))).segment, r"segment.*\(2, 3\)"),
    ],
)
def test_an_inconsistent_view_is_refused_by_name(change, named):
    with pytest.raises(TaskViewError, match=named):
        change(sample.task(6))


def test_all_that_is_reported_has_a_message_that_is_a_sentence_with_and_without_labels():
    assert set(KINDS) >= {reported.value for reported in (*Refusal, *EventKind)}
    for key in KINDS:
        for bar in (
            message(key, sample.TEXTS),
            message(key, sample.TEXTS, object="Blue mug", receptacle="Office supply box"),
        ):
            assert bar.text[0].isupper() and bar.text.endswith(".") and "{" not in bar.text
            assert "Blue mug" not in bar.text, "labels read as part of the sentence"
        assert (message(key, sample.TEXTS).kind is MessageKind.SUCCESS) is (
            key in ("picked", "placed", "finished")
        )
    with pytest.raises(MessageError, match=r"'oops'.*hands_full"):
        message("oops", sample.TEXTS)


@pytest.mark.parametrize(
    ("label", "inside"),
    [
        ("Blue mug", "blue mug"), ("T-shirt", "T-shirt"), ("LEGO car", "LEGO car"), ("Office-supply box",
        "office-supply box"), ("Turquoise T-shirt", "turquoise T-shirt"), ("Stapler", "stapler"), ("", ""),
    ],
)  # fmt: skip
def test_labels_inside_a_sentence(label, inside):
    assert in_sentence(label) == inside


def test_a_sentence_that_begins_with_a_label_keeps_its_capital():
    texts = dataclasses.replace(sample.TEXTS, placed="{Object} is in {receptacle}. {Receptacle}: {object}.")
    found = message("placed", texts, object="Blue mug", receptacle="Dish bin").text
    assert found == "Blue mug is in dish bin. Dish bin: blue mug."
    assert message("placed", texts).text.startswith(texts.object)


def test_messages_are_shown_for_three_and_a_half_seconds_and_fade_within_half_a_second():
    """The display time is part of the treatment, and the documentation promises it."""
    assert [fade(t) for t in (0.0, 3.5, 3.625, 3.75, 4.0, 1e9)] == pytest.approx([1, 1, 0.75, 0.5, 0, 0])


@pytest.mark.parametrize("base", ["none", "highlight", "optimal"])
def test_x_ray_changes_nothing_but_that_markers_show_through_walls(base):
    view = sample.task(12, steps=5)
    plain, x_ray = shown(base, view), shown(f"{base}-xray", view)
    assert all(m.x_ray for m in x_ray.markers)
    through = tuple(dataclasses.replace(m, x_ray=True) for m in plain.markers)
    assert dataclasses.replace(plain, markers=through) == x_ray


@pytest.mark.parametrize("base", ["none", "highlight", "optimal"])
def test_flagpoles_are_found_by_object_where_they_are_drawn(base):
    view = sample.task(12, steps=6)
    near = dataclasses.replace(
        view, position=view.objects[7].position[:2]
    )  # one object is so near that its pole is low and has no flag
    for seen in (view, near):
        loose = {o.name: o.position[:2] for o in seen.objects if o.status == "loose"}
        state = shown(base, seen)
        assert flagpoles(state) == ({} if base == "none" else loose)
        assert all(m.x_ray for m in state.markers if m.role == "flagpole"), "known through walls"


@pytest.mark.parametrize("base", ["none", "highlight", "optimal"])
def test_the_map_tells_no_more_than_the_condition(base):
    view = dataclasses.replace(
        sample.task(12, steps=5), bounds=(-4.0, -1.0, 4.0, 7.0), position=(0.5, 0.25), heading=0.7
    )
    state = shown(f"{base}-minimap", view)
    assert dataclasses.replace(state, minimap=None) == shown(base, view)
    found = state.minimap
    assert found is not None
    assert (found.bounds, found.position, found.heading) == (view.bounds, view.position, view.heading)
    loose = {o.position[:2] for o in view.objects if o.status == "loose"}
    assert set(found.objects) == (set() if base == "none" else loose)
    assert len(found.objects) == len(set(found.objects))
    crumbs = [m.position[:2] for m in state.markers if m.role == "breadcrumb"]
    assert list(found.path) == crumbs and (len(crumbs) > 0) is (base == "optimal")
    assert found.goal is None
    assert shown(f"{base}-pin-minimap", view).minimap.goal == view.goal[:2]


def knowing(view, *alternatives):
    return dataclasses.replace(view, alternatives=lambda: alternatives)


def details(state):
    return {f"{row.number or ''}{row.text}": " ".join(row.detail.split()) for row in state.checklist}


def test_regrets_stand_beside_what_can_be_done_next_and_nowhere_else():
    plain = sample.task(6, steps=1)  # mug in hand; plan: pick up the car, place both
    mug, car, novel, shirt, stapler = (o.name for o in plain.objects[:5])
    view = knowing(
        plain,
        Alternative("pick", car, 0.0),
        Alternative("place", mug, 0.004),
        Alternative("pick", novel, 2.34),
        Alternative("pick", shirt, 1.0, at_least=True),
        Alternative("pick", stapler, 0.03),
    )
    assert details(shown("optimal-regret", view)) == details(shown("optimal", view)) | {
        "3Blue mug": "Put in Dish bin · Kitchen · +0 m",
        "5Novel": "Pick up · Bedroom · +2.3 m",
        "6T-shirt": "Pick up · Kitchen · over +1.0 m",
        "9Stapler": "Pick up · Office · +0.1 m",
    }
    listed = details(shown("none-regret", view))
    assert listed["Toy car"] == "→ Toy box · +0 m"
    assert listed["Novel"] == "→ Bookshelf · +2.3 m"
    assert listed["Blue mug"] == "→ Dish bin · +0 m"
    assert listed["Cardboard box"] == "→ Recycling bin"


def test_a_regret_of_a_centimetre_is_shown_as_none_and_a_larger_one_is_rounded_up():
    plain = sample.task(6)
    regrets = (0.0, 0.01, 0.0101, 0.1, 0.1001, 1.0)
    known = (Alternative("pick", o.name, regret) for o, regret in zip(plain.objects, regrets, strict=True))
    listed = details(shown("none-regret", knowing(plain, *known)))
    shown_regrets = [listed[o.label].rpartition(" · ")[2] for o in plain.objects]
    assert shown_regrets == ["+0 m", "+0 m", "+0.1 m", "+0.1 m", "+0.1 m", "+1.0 m"]


def test_a_list_whose_rows_are_no_steps_shows_no_regrets(own_module):
    """A condition of the user's own lists what it wants to."""
    text = "from hud.lists import assemble\ndef hud_state(view):\n    return assemble(view, 'Mine', ())\n"
    own_module(text, "own_list")
    view = knowing(sample.task(6), Alternative("pick", "object_00", 5.0))
    assert shown("own_list:hud_state-regret", view) == shown("own_list:hud_state", view)


def test_a_step_that_was_done_and_can_be_done_again_is_noted_once():
    """The mug was dropped, so the plan contains picking it up as a finished and as a possible step."""
    plain = sample.task(6, steps=1)
    mug = dataclasses.replace(plain.objects[0], status="loose")
    again = (TaskStep("pick", plain.objects[1].name), TaskStep("pick", mug.name))
    view = dataclasses.replace(
        plain, objects=(mug, *plain.objects[1:]), hands=(None, None), ahead=KnownPlan(again + plain.plan[2:])
    )
    rows = shown("optimal-regret", knowing(view, Alternative("pick", mug.name, 5.0))).checklist
    assert ["+5.0 m" in row.detail for row in rows[:4]] == [False, False, True, False]


def test_options_combine_and_follow_outside_conditions():
    view = dataclasses.replace(sample.task(6), bounds=(-4.0, -1.0, 4.0, 7.0))
    both = shown("hud.builtin_conditions:highlight-xray-minimap", view)
    assert both == shown("highlight-minimap-xray", view)
    assert both.minimap is not None and all(m.x_ray for m in both.markers)


def test_flags_of_near_objects_are_low():
    """Flags must not fill the view of a person who stands in front of the object."""
    view = sample.task(6)
    item = view.objects[0]
    x, y, _ = item.position

    def top(distance):
        markers = shown("highlight", dataclasses.replace(view, position=(x + distance, y))).markers
        here = [m for m in markers if np.hypot(m.position[0] - x, m.position[1] - y) < 0.2]
        return max(m.position[2] + (m.size[2] if m.shape == "box" else m.size[1]) for m in here)

    assert top(1.2) < 0.9 and top(2.0) > 1.4
