"""Section 5, the assistance conditions: each test is a sentence of docs/paper.md, on frames of three sizes."""

import math

import cv2
import numpy as np
import pytest
from sessions import SIZES, opened, play

from hud import theme
from hud.compose import Compositor
from hud.markers import BREADCRUMB, BREADCRUMB_RADIUS, CHEST, FLAGPOLE
from mjsim.house.sight.sight import FieldOfView, in_field_of_view, visible_objects
from mjsim.render import CameraPose, Renderer
from mjsim.render.markers import LINES
from mjsim.values.observation import ObjectStatus

CONDITIONS = ("none", "highlight", "optimal")
UPDATED = "The plan has been updated."
sizes = pytest.mark.parametrize("size", SIZES, ids=lambda size: f"{size[0]}x{size[1]}")


@pytest.fixture(scope="module")
def starts(house):
    """The first state under each condition, of the same house."""
    found = {}
    for name in (*CONDITIONS, "guided"):
        session, world, _ = opened(house, name, objects=12)
        observation = world.reset()
        session.assistant.begin(observation)
        found[name] = world, observation, session.assistant.hud_state(observation)
    return found


@pytest.fixture(scope="module")
def highlighted(house):
    """Somebody who goes for flagpoles."""
    return play(house, "highlight")


def tiles(state, texts, pictures, size, panel):
    """The entries of a list, and the pictures in its rows of a frame, in order, each (s, s, 3)."""
    compositor, (width, height) = Compositor(pictures, texts), size
    frame = compositor.compose(np.full((height, width, 3), 90, np.uint8), state)
    layout = compositor.layout(state, width, height)
    rect, unit = layout.panels[panel], compositor._stencils.unit

    def px(value):
        return round(value * unit)

    top, left = rect.y + px(theme.HEADER), rect.x + px(theme.PADDING + 2)
    if panel == "bins":
        rows, entries, side, down = layout.bin_rows, state.bins, px(theme.BIN_TILE), px(1)
    else:
        rows, entries = layout.rows, state.checklist[layout.first : layout.stop]
        side, down = px(theme.TILE), px(3)
    for row, entry in zip(rows, entries, strict=False):
        x = left + (px(theme.NUMBER) if getattr(entry, "number", None) is not None else 0)
        yield entry, frame[top + down : top + down + side, x : x + side]
        top += row.height


def likest(tile, pictures, kind):
    """The picture that a tile shows, by correlation with all of them over the light square that they lie on."""
    scores = {}
    for key, picture in pictures.items():
        if key.startswith(kind):
            small = cv2.resize(picture, tile.shape[1::-1], interpolation=cv2.INTER_AREA).astype(float)
            alpha = small[:, :, 3:] / 255
            expected = small[:, :, :3] * alpha + np.array(theme.TILE_COLOUR) * (1 - alpha)
            scores[key] = np.abs(expected - tile)[3:-3, 3:-3].mean()
    return min(scores, key=scores.get)


@sizes
@pytest.mark.parametrize("assistance", CONDITIONS)
def test_all_conditions_show_the_bins_with_picture_room_and_place(starts, house, pictures, size, assistance):
    _, _, state = starts[assistance]
    catalogue = house.catalogue
    assert [(b.label, b.place) for b in state.bins] == [
        (r.label, f"{house.rooms.label(r.room)}, {r.place}") for r in catalogue.receptacles.values()
    ]
    rows = Compositor(pictures, house.texts).layout(state, *size).bin_rows
    assert [" ".join(row.detail) for row in rows] == [b.place for b in state.bins], "read whole"
    found = list(tiles(state, house.texts, pictures, size, "bins"))
    assert len(found) == 6
    assert all(likest(tile, pictures, "receptacle:") == entry.picture for entry, tile in found)


@sizes
@pytest.mark.parametrize("assistance", CONDITIONS)
def test_the_rows_of_the_list_stand_in_their_order_with_their_pictures(
    starts, house, pictures, size, assistance
):
    rows = list(tiles(starts[assistance][2], house.texts, pictures, size, "checklist"))
    assert len(rows) >= 6
    assert all(likest(tile, pictures, "object:") == item.picture for item, tile in rows)


def test_none_and_highlight_list_in_the_participants_random_order(house):
    orders = {}
    for assistance in ("none", "highlight"):
        for seed in range(3):
            session, world, _ = opened(house, assistance, objects=12, order_seed=seed)
            session.assistant.begin(world.reset())
            state = session.assistant.hud_state(world.observation())
            orders[assistance, seed] = tuple(item.text for item in state.checklist)
    assert all(orders["none", seed] == orders["highlight", seed] for seed in range(3))
    assert len(set(orders.values())) == 3


@pytest.mark.slow
def test_picked_objects_are_crossed_out_and_move_to_the_bottom(highlighted):
    for observation, state in highlighted.shown:
        done = [item.done for item in state.checklist]
        assert done == sorted(done)
        assert sum(done) == sum(status is not ObjectStatus.LOOSE for status in observation.object_status)


def test_none_shows_nothing_in_the_world_and_no_room_of_an_object(starts, house):
    _, _, state = starts["none"]
    assert state.markers == ()
    bins = {receptacle.label for receptacle in house.catalogue.receptacles.values()}
    assert {item.detail.removeprefix("→ ") for item in state.checklist} == bins


def test_highlight_adds_the_room_of_each_object(starts, house):
    world, _, state = starts["highlight"]
    by_label = {house.catalogue.objects[o.model].label: o for o in world.scene.episode.objects}
    for item in state.checklist:
        room = house.rooms.room_at(by_label[item.text].position[:2])
        assert item.detail.startswith(house.rooms.label(room))


def test_highlight_has_a_flagpole_over_every_misplaced_object_and_no_other(highlighted):
    for observation, state in highlighted.shown[::20]:
        poles = {marker.object for marker in state.markers if marker.role == FLAGPOLE}
        assert poles == set(observation.names_with(ObjectStatus.LOOSE))


@pytest.mark.slow
@sizes
@pytest.mark.parametrize("assistance", ["highlight", "optimal"])
def test_flagpoles_are_seen_through_walls_dimmed(starts, size, assistance):
    """Every pole in the field of view has pixels; except for the lines around them, hidden ones change them less."""
    world, observation, state = starts[assistance]
    gaze = observation.eye, observation.heading, observation.pitch
    seen = set(visible_objects(world.scene, world.data, *gaze))
    field = FieldOfView.of(world.scene.person)
    change = {True: [], False: []}
    with Renderer(world.scene.model, width=size[0], height=size[1], profile="draft") as renderer:
        plain = renderer.rgb(world.data)
        for name in observation.object_names:
            pole = [m for m in state.markers if m.object == name and m.role == FLAGPOLE]
            top = max(pole, key=lambda m: m.position[2])
            if not in_field_of_view([top.position], *gaze, field)[0]:
                continue
            shown = renderer.rgb(world.data, markers=pole).astype(int)
            difference = np.abs(shown - plain).max(axis=2)
            assert (difference > 8).any(), f"{name} has no pole in the picture"
            lines = np.any([(shown == tone).all(axis=2) for tone in LINES], axis=0)
            change[name in seen].append(np.percentile(difference[(difference > 8) & ~lines], 90))
    assert change[False], "no object is hidden here"
    if change[True]:
        assert np.median(change[False]) < np.median(change[True])


@sizes
def test_breadcrumbs_descend_from_chest_height_to_the_floor(starts, size):
    """Their heights from depth images, each seen from beside; the last one is inside the object that it leads to."""
    world, _, state = starts["optimal"]
    crumbs = [m for m in state.markers if m.role == BREADCRUMB]
    assert len(crumbs) > 5
    heights = []
    with Renderer(world.scene.model, width=size[0], height=size[1], profile="draft") as renderer:
        for crumb in (crumbs[0], crumbs[len(crumbs) // 2], crumbs[-2]):
            target = np.array(crumb.position)
            eye = target + np.array([0.12, 0.1, 0.3])
            pose = CameraPose.looking_at(eye, target, math.radians(40.0))
            without, found = (renderer.depth(world.data, pose, markers=m) for m in ((), [crumb]))
            rows, columns = np.nonzero(found < without - 1e-4)
            assert len(rows) > 50
            depth = found[rows, columns]
            up = (size[1] / 2 - rows - 0.5) / (size[1] / 2) * math.tan(pose.fovy / 2) * depth
            right = (columns + 0.5 - size[0] / 2) / (size[1] / 2) * math.tan(pose.fovy / 2) * depth
            points = eye + np.column_stack([right, up, -depth]) @ pose.rotation.T
            heights.append(float(points[:, 2].max()) - BREADCRUMB_RADIUS)
    length = len(crumbs) - 1
    assert heights[0] == pytest.approx(1.6 * CHEST, abs=0.02 + 1.2 / length)
    assert heights[1] == pytest.approx(0.8 * CHEST, abs=0.05 + 1.2 / length)
    assert heights[2] == pytest.approx(BREADCRUMB_RADIUS, abs=0.02 + 1.2 / length)
    assert crumbs[-1].position[2] == pytest.approx(BREADCRUMB_RADIUS)
    assert {crumb.rgba[:3] for crumb in crumbs} == {(0.90, 0.10, 0.06)}


def test_optimal_shows_breadcrumbs_and_flagpoles_and_nothing_else(starts):
    assert {marker.role for marker in starts["optimal"][2].markers} == {BREADCRUMB, FLAGPOLE}
    assert starts["optimal"][2].pointer is None


def test_the_segment_stays_until_the_next_visit_whoever_strays(own_way):
    """It changes only with a pick or place, and ends where the next step takes place."""
    shown, changes = None, []
    for observation, state in own_way.shown:
        crumbs = tuple(m.position for m in state.markers if m.role == BREADCRUMB)
        if crumbs != shown:
            changes.append(observation.time)
            shown = crumbs
    visits = [event["t"] for event in own_way.of("visit")]
    moved = [t for t in changes[1:] if min(abs(t - v) for v in visits) > 0.1]
    # An object that is pushed takes the segment's end along.
    assert len(moved) <= 0.02 * len(own_way.shown)
    assert len(changes) >= len(visits)


def test_under_optimal_the_list_is_the_plan_and_done_steps_are_crossed_out(own_way):
    for _, state in own_way.shown[::10]:
        assert [item.number for item in state.checklist] == list(range(1, 13))
        done = [item.done for item in state.checklist]
        assert done == sorted(done, reverse=True)
        assert [item.current for item in state.checklist].count(True) == (0 if all(done) else 1)


@pytest.mark.slow
@pytest.mark.parametrize(("assistance", "told"), [("none", False), ("highlight", False), ("guided", True)])
def test_replanning_is_announced_where_the_plan_is_shown_and_only_there(house, assistance, told):
    played = play(house, assistance, user="boltzmann:30", objects=3)
    assert len(played.of("plan")) > 1
    texts = {state.message.text for _, state in played.shown if state.message is not None}
    assert (UPDATED in texts) == told


def test_under_optimal_replanning_is_announced(own_way):
    """For 2 s, after what was done has been told for as long."""
    replans = [event["t"] for event in own_way.of("plan")][1:]
    assert len(replans) >= 3
    told = [(o.time, s.message.text) for o, s in own_way.shown if s.message and s.message.opacity == 1.0]
    for t in replans:
        texts = [text for time, text in told if t <= time < t + 6.0]
        assert texts[0].startswith("You p")  # picked up, put
        if t <= own_way.shown[-1][0].time - 4.0:
            assert min(texts.index(UPDATED), texts.count(UPDATED)) >= 2.0 / 0.04 - 1
