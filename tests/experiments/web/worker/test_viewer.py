"""What a page is told while the clock is paused and while it runs."""

import dataclasses
from types import SimpleNamespace

import msgspec
import numpy as np
import pytest

from experiments.trials.trial_config import TrialConfig
from experiments.web import protocol
from experiments.web.controls import Input
from experiments.web.protocol import View
from experiments.web.state import GaitParameters, Hud, Markers, Moment, Pictures, SceneMessage, Snapshot
from experiments.web.worker.live_session import LiveSession, open_journal
from experiments.web.worker.viewer import HUD_EVERY, BrowserViewer
from mjsim.house.scene.avatar import EYE
from mjsim.render.cameras import camera_pose
from mjsim.world.fidelity import kinematics

CONFIG = TrialConfig(objects=3, assistance="guided", seed=3, user="human", live=True, fidelity="event")
DRAWS = View(1920, 1080, "none")
BESIDE = {"Hud", "Moment"}


@pytest.fixture
def shown(tmp_path, house):
    """A viewer of a session, what it sent, and a drawer that can be told that the clock is paused."""
    sent = []
    viewer = BrowserViewer(sent.append)
    live = LiveSession(open_journal(tmp_path), house, CONFIG, viewer)
    drawer = SimpleNamespace(hidden=True, drawn=[], scene=live.scene, pictures=lambda: Pictures({}, {}))
    drawer.draw = lambda *moment: drawer.drawn.append(moment[-1])
    drawer.set_view = lambda _: None
    viewer.live, viewer.drawer = live, drawer
    viewer.set_view(DRAWS)
    return SimpleNamespace(viewer=viewer, sent=sent, live=live, drawer=drawer)


def kinds(shown):
    return {type(message).__name__ for message in shown.sent}


def of_kind(shown, kind):
    return [message for message in shown.sent if isinstance(message, kind)]


def test_nothing_of_the_task_is_sent_while_the_clock_stands(shown):
    shown.live.session.show()
    assert kinds(shown) == {"SceneMessage", "Pictures"} and shown.drawer.drawn == [True]
    shown.drawer.hidden = False
    shown.live.session.show()
    assert kinds(shown) == {"SceneMessage", "Pictures", "Snapshot", "Markers", *BESIDE}
    assert shown.drawer.drawn == [True, False]


def test_a_client_that_shows_frames_gets_no_states(shown):
    shown.drawer.hidden = False
    shown.viewer.set_view(View(640, 480))
    shown.live.session.show()
    assert kinds(shown) == {"Busy", *BESIDE}


def test_the_scene_has_what_a_prediction_needs(shown):
    shown.live.session.show()
    (scene,) = of_kind(shown, SceneMessage)
    assert scene.gait == GaitParameters(*kinematics.Gait.of(shown.live.scene, shown.live.world.options))
    assert msgspec.structs.asdict(scene.gait).keys() == set(kinematics.Gait._fields)
    assert scene.field_of_view == shown.live.scene.person.field_of_view and scene.step_duration == 0.04


def test_snapshots_have_the_body_and_what_changed(shown, monkeypatch):
    shown.drawer.hidden = False
    monkeypatch.setattr("experiments.web.worker.snapshots.LINGERING", 1)
    monkeypatch.setattr("experiments.web.worker.snapshots.LOOK_EVERY", 1)
    names, seen = shown.live.world.observation().object_names, []
    monkeypatch.setattr(
        "experiments.web.worker.snapshots.PotentialVisibility",
        lambda *_: SimpleNamespace(may_see=lambda *_: np.isin(names, seen)),
    )
    for now in (names[:2], names[:2], names[1:]):
        seen[:] = now
        shown.viewer.look()
        shown.live.step([Input(number=shown.live.input + 1, forward=1.0)])
    seen[:] = names[1:]
    shown.viewer.look()
    snapshots = of_kind(shown, Snapshot)
    assert [snapshot.step for snapshot in snapshots] == [0, 1, 2, 3]
    assert [snapshot.input for snapshot in snapshots] == [0, 1, 2, 3]
    assert [list(snapshot.objects) for snapshot in snapshots] == [list(names[:2]), [], [names[2]], []]
    assert [snapshot.gone for snapshot in snapshots] == [[], [], [names[0]], []]
    models = {item.name: item.model for item in shown.live.scene.episode.objects}
    assert snapshots[0].models == {name: models[name] for name in names[:2]}
    assert np.array_equal(snapshots[-1].body, shown.live.world.body)
    assert np.shape(snapshots[-1].hands) == (2, 3) and snapshots[-1].held == (None, None)


def test_the_display_of_a_client_that_draws_is_looked_at_now_and_then_and_when_something_happens(shown):
    shown.drawer.hidden, composed = False, []
    compose = shown.live.session.assistant.hud_state
    shown.live.session.assistant.hud_state = lambda *seen: composed.append(seen) or compose(*seen)
    for _ in range(4 * HUD_EVERY):
        shown.live.step([])
        shown.viewer.look()
    assert len(composed) == 4 and len(of_kind(shown, Snapshot)) == 4 * HUD_EVERY
    shown.drawer.hidden = True
    shown.viewer.look()
    shown.drawer.hidden = False
    shown.viewer.look()
    assert shown.viewer._glance[-1] is False


def test_a_view_that_is_opened_anew_gets_everything(shown):
    shown.drawer.hidden = False
    shown.live.session.show()
    before = kinds(shown)
    shown.sent.clear()
    shown.viewer.set_view(View(1280, 720, "none"))
    shown.live.session.show()
    assert kinds(shown) == before


def test_the_display_has_no_markers_and_survives_the_way_to_the_page(shown):
    shown.drawer.hidden = False
    shown.live.session.show()
    (hud,) = of_kind(shown, Hud)
    assert hud.state.markers == () and hud.state.checklist and hud.state.clock is None
    assert of_kind(shown, Markers)[0].markers
    for message in shown.sent:
        assert protocol.decode_from_worker(protocol.packed(message)[protocol.LENGTH.size :]) == message
        assert msgspec.json.decode(protocol.encode_to_browser(message))["type"]


def test_a_moment_names_the_room_and_what_the_action_key_would_take(shown):
    shown.drawer.hidden = False
    world, live = shown.live.world, shown.live
    shown.live.session.show()
    before = of_kind(shown, Moment)
    assert before[-1].room in live.house.rooms.labels.values() and before[-1].reach is None
    seen = world.observation()
    item = live.scene.episode.objects[0]
    world.answer = lambda action: SimpleNamespace(
        applied=type(action).__name__ == "Pick", action=action, object=item.name, refusal=None
    )
    shown.viewer._noticed.clear()
    above = np.array([item.position[0] - 0.3, item.position[1], 1.6])
    away, towards = (dataclasses.replace(seen, eye=above, heading=0.0, pitch=pitch) for pitch in (1.2, -1.2))
    assert shown.viewer._reach(live, away, False) is None, (
        "its label would reveal an object that was not in the picture"
    )
    assert shown.viewer._reach(live, away, True) is not None, "a marker shows where it is"
    assert shown.viewer._reach(live, towards, False) is not None
    reach = shown.viewer._reach(live, away, False)
    assert reach.object == live.house.catalogue.objects[item.model].label and reach.receptacle is None
    assert reach.at is None or all(0.0 <= share <= 1.0 for share in reach.at)
    assert reach.instance == item.name
    assert np.allclose(reach.place, seen.object_positions[seen.object_names.index(item.name)], atol=1e-4)


@pytest.mark.parametrize(
    ("limits", "view", "angle"),
    [
        (None, View(1920, 1080, "none", 2.0), None),
        ("1.0,1.9", View(1920, 1080, "none", 1.7), 1.7),
        ("1.0,1.9", View(1920, 1080, "none", 2.0), 1.9),
        ("1.0,1.9", View(1920, 1080, "none", 0.5), 1.0),
        ("1.0,1.9", DRAWS, None),
        ("1.0,1.3", DRAWS, 1.3),
        ("1.0,1.9", View(640, 480, "jpeg", 1.7), None),
    ],
)
def test_a_person_chooses_how_wide_the_view_is_within_limits(shown, limits, view, angle):
    shown.live.config = msgspec.structs.replace(CONFIG, field_of_view_range=limits)
    shown.viewer.set_view(view)
    shown.live.session.show()
    angle = angle or shown.live.scene.person.field_of_view
    camera = shown.viewer.camera(shown.live.world)
    aspect = 16 / 9 if view.codec == "none" else 4 / 3
    assert 2.0 * np.arctan(aspect * np.tan(camera.fovy / 2.0)) == pytest.approx(angle)
    for scene in of_kind(shown, SceneMessage):
        assert scene.field_of_view == angle
        assert scene.field_of_view_range == (limits and tuple(map(float, limits.split(","))))


@pytest.mark.parametrize(("view", "aspect"), [(DRAWS, 16 / 9), (View(640, 360), 4 / 3)])
def test_a_camera_is_as_wide_as_the_person_sees_whatever_the_shape_of_the_view(shown, view, aspect):
    shown.viewer.set_view(view)
    camera, person = shown.viewer.camera(shown.live.world), shown.live.scene.person
    pose = camera_pose(shown.live.world.model, shown.live.world.data, EYE, aspect)
    assert np.allclose(camera.position, pose.position) and np.allclose(camera.rotation, pose.rotation)
    assert camera.width / camera.height == pytest.approx(aspect, abs=0.01)
    assert 2.0 * np.arctan(aspect * np.tan(camera.fovy / 2.0)) == pytest.approx(person.field_of_view)
