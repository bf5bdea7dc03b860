"""The task as conditions see it: scrolling, completed steps, messages, and where the objects are."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from sessions import play

from experiments.session.task_board import READING_TIME, PlanView, TaskBoard
from hud.messages import message
from mjsim.values.observation import ObjectStatus, Observation
from planner.plan import Visit, VisitKind

OBJECTS = 6
PICK, PLACE = VisitKind.PICK, VisitKind.PLACE


@pytest.fixture(scope="module")
def episode(house):
    return house.sample_episode(objects=OBJECTS, seed=0)


@pytest.fixture
def board(house, episode):
    return TaskBoard(house, episode, [placed.name for placed in episode.objects])


@pytest.fixture
def start(episode):
    """The state in which all objects are where the episode has them."""
    return Observation(
        time=0.0,
        position=np.array([episode.start.x, episode.start.y]),
        heading=0.7,
        pitch=0.0,
        eye=np.array([episode.start.x, episode.start.y, 1.6]),
        velocity=np.zeros(2),
        object_names=tuple(placed.name for placed in episode.objects),
        object_positions=np.array([placed.position for placed in episode.objects]),
        object_quaternions=np.tile([1.0, 0.0, 0.0, 0.0], (OBJECTS, 1)),
        object_status=(ObjectStatus.LOOSE,) * OBJECTS,
        hands=(None, None),
        busy=False,
    )


def at(seen, time):
    return dataclasses.replace(seen, time=time)


def scrolled(board, seen, *rows):
    for number in rows:
        board.scroll(number)
    return board.view(seen).scroll


def test_rows_add_up_within_the_longest_list(board, start):
    assert scrolled(board, start) == 0
    assert scrolled(board, start, 3, -1) == 2
    assert (
        scrolled(board, start, 100, 100) == 2 * OBJECTS
    )  # the optimal list has a pick and a place per object
    assert scrolled(board, start, -1) == 2 * OBJECTS - 1, "rows beyond the end do not count"
    assert scrolled(board, start, -100, -100) == -2 * OBJECTS


def test_a_visit_returns_the_list_to_the_current_step_and_is_listed(board, start, episode):
    first, second = episode.objects[0].name, episode.objects[1].name
    assert scrolled(board, start, 4) == 4
    board.note_visit(Visit(PICK, first))
    assert board.view(start).scroll == 0
    assert scrolled(board, start, -2) == -2
    for visit in (Visit(PICK, second), Visit(PLACE, first)):
        board.note_visit(visit)
    view = board.view(start)
    assert view.scroll == 0
    assert view.steps_done == (("pick", first), ("pick", second), ("place", first))


def test_objects_have_their_places_rooms_and_bins_of_the_moment(board, start, house, episode):
    for placed, found in zip(episode.objects, board.view(start).objects, strict=True):
        assert (found.name, found.position, found.status) == (placed.name, placed.position, "loose")
        assert found.label == house.catalogue.objects[placed.model].label
        assert found.room == house.rooms.label(house.rooms.room_at(placed.position[:2]))
        assert found.receptacle == episode.targets[placed.name]
    positions = start.object_positions.copy()
    positions[0] = *house.receptacles[episode.targets[start.object_names[1]]].center[:2], 1.2
    moved = dataclasses.replace(start, object_positions=positions)
    before, after = board.view(start).objects, board.view(moved).objects
    assert after[0].position == tuple(positions[0]) and after[1:] == before[1:]
    assert after[0].room == house.rooms.label(house.rooms.room_at(positions[0, :2]))
    status = (ObjectStatus.CARRIED, ObjectStatus.DELIVERED, *start.object_status[2:])
    held = dataclasses.replace(moved, object_status=status, hands=(start.object_names[0], None))
    assert [o.status for o in board.view(held).objects] == [
        "carried",
        "delivered",
        *["loose"] * (OBJECTS - 2),
    ]
    assert board.view(start).objects == before


def test_the_view_is_that_of_the_person_who_stands_there(board, start):
    view = board.view(start, capacity=1)
    assert (view.position, view.eye) == (tuple(start.position), tuple(start.eye))
    assert (view.heading, view.clock, view.capacity, view.hands) == (0.7, 0.0, 1, (None, None))


def test_the_goal_is_the_object_or_the_bin(board, start, house, episode):
    name = episode.objects[2].name
    assert board.goal(start, Visit(PICK, name)) == tuple(start.object_positions[2])
    assert board.goal(start, Visit(PLACE, name)) == tuple(house.receptacles[episode.targets[name]].center)


def test_a_message_names_the_object_and_its_bin_and_fades(board, start, house, episode):
    placed = episode.objects[0]
    label = house.catalogue.objects[placed.model].label
    bin_label = house.catalogue.receptacles[episode.targets[placed.name]].label
    assert board.view(start).message is None
    board.show_message("not_the_receptacle", 1.0, placed.name)
    expected = message("not_the_receptacle", house.texts, object=label, receptacle=bin_label)
    assert expected != message("not_the_receptacle", house.texts)
    for time, opacity in ((1.0, 1.0), (4.5, 1.0), (4.75, 0.5)):
        found = board.view(at(start, time)).message
        assert (found.text, found.kind, found.opacity) == (
            expected.text,
            expected.kind,
            pytest.approx(opacity),
        )
    assert board.view(at(start, 5.0)).message is None
    board.show_message("unknown_object", 6.0, "nobody")
    assert board.view(at(start, 6.0)).message == message("unknown_object", house.texts)


def text_at(board, seen, time):
    found = board.view(at(seen, time)).message
    return None if found is None else found.text


def test_a_success_can_be_read_for_two_seconds_before_the_new_plan_is_announced(board, start, house, episode):
    name = episode.objects[0].name
    board.show_message("placed", 10.0, name)
    success, announced = text_at(board, start, 10.0), message("replanned", house.texts).text
    board.announce_replan(10.0)
    assert [text_at(board, start, t) for t in (10.0, 11.99)] == [success, success]
    assert [text_at(board, start, t) for t in (12.0, 15.5)] == [announced, announced]
    assert text_at(board, start, 16.0) is None
    board.announce_replan(20.0)
    assert text_at(board, start, 20.0) == announced, "the last message was read long ago"


@pytest.mark.parametrize("assistance", ["optimal", "highlight"])
def test_a_session_announces_every_new_plan_and_only_if_its_condition_shows_plans(house, assistance):
    """The nearest object is often not the planned one."""
    played, announced = play(house, assistance, user="nearest"), message("replanned", house.texts).text
    shown = [o.time for o, state in played.shown if state.message and state.message.text == announced]
    renewed = [event["t"] for event in played.of("plan")][1:] if assistance == "optimal" else []
    for time in renewed:
        assert any(time <= at <= time + READING_TIME + 0.1 for at in shown), "after the last message was read"
    assert all(any(0.0 <= at - time < 10.1 for time in renewed) for at in shown)
    assert len(renewed) == (5 if assistance == "optimal" else 0)


@pytest.mark.parametrize(("refused_at", "again"), [(12.5, True), (13.99, True), (14.0, False), (15.0, False)])
def test_an_announcement_that_a_refusal_interrupts_returns_unless_it_was_read(
    board, start, house, refused_at, again
):
    board.show_message("placed", 10.0)
    board.announce_replan(10.0)
    refusal, announced = (message(key, house.texts).text for key in ("hands_full", "replanned"))
    assert text_at(board, start, 12.2) == announced
    board.show_message("hands_full", refused_at)
    assert text_at(board, start, refused_at) == refusal
    assert text_at(board, start, refused_at + 1.99) == refusal
    assert text_at(board, start, refused_at + 2.0) == (announced if again else refusal)


def test_a_plan_is_shown_by_its_steps_its_paths_and_its_goal(board, start):
    first, second = start.object_names[:2]
    visits = (Visit(PICK, first), Visit(PICK, second), Visit(PLACE, second))
    asked, points = [], np.array([[0.0, 0.0], [1.0, 1.0]])
    paths = SimpleNamespace(
        segment=SimpleNamespace(points=points), path=SimpleNamespace(ahead=lambda position: position[None])
    )

    def paths_to(visit):
        asked.append(visit)
        return paths

    shown = PlanView(board, start, lambda: SimpleNamespace(visits=visits, next=visits[0]), paths_to)
    view = board.view(start, ahead=shown)
    assert asked == [], "nothing is computed for a condition that shows no plan"
    assert view.plan == (("pick", first), ("pick", second), ("place", second))
    assert view.segment is points and view.path.tolist() == [start.position.tolist()]
    assert view.goal == tuple(start.object_positions[0])
    assert set(asked) == {visits[0]}


@pytest.mark.parametrize("route", [None, SimpleNamespace(visits=(), next=None)])
def test_without_a_next_visit_there_is_nothing_to_show(board, start, route):
    view = board.view(start, ahead=PlanView(board, start, lambda: route, lambda _: pytest.fail("no visit")))
    assert (view.plan, view.segment, view.path, view.goal) == ((), None, None, None)
