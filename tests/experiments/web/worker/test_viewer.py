"""What a page is told while the clock is paused and while it runs."""

from types import SimpleNamespace

import msgspec
import pytest

from experiments.trials.trial_config import TrialConfig
from experiments.web import protocol
from experiments.web.protocol import Hud, Moment, Snapshot, View
from experiments.web.worker.drawing import Drawer
from experiments.web.worker.live_session import LiveSession, open_journal
from experiments.web.worker.viewer import BrowserViewer

CONFIG = TrialConfig(objects=3, assistance="guided", seed=3, user="human", live=True, fidelity="event")


@pytest.fixture
def shown(tmp_path, house):
    """A viewer of a session, what it sent, and a drawer that can be told that the clock is paused."""
    sent = []
    viewer = BrowserViewer(sent.append)
    live = LiveSession(open_journal(tmp_path), house, CONFIG, viewer)
    drawer = SimpleNamespace(hidden=True, drawn=[], scene=live.scene)
    drawer.draw = lambda *moment: drawer.drawn.append(moment[-1])
    drawer.set_view = lambda _: None
    drawer.camera_view = lambda data: Drawer.camera_view(SimpleNamespace(_scene=live.scene), data)
    viewer.live, viewer.drawer = live, drawer
    viewer.set_view(View(640, 480, snapshots=True))
    return SimpleNamespace(viewer=viewer, sent=sent, live=live, drawer=drawer)


def test_nothing_of_the_task_is_sent_while_the_clock_stands(shown):
    shown.live.session.show()
    assert shown.sent == [] and shown.drawer.drawn == [True]
    shown.drawer.hidden = False
    shown.live.session.show()
    assert {type(message).__name__ for message in shown.sent} == {"Snapshot", "Hud", "Moment", "Busy"}
    assert shown.drawer.drawn == [True, False]


def test_a_snapshot_has_only_what_is_in_view(shown, monkeypatch):
    shown.drawer.hidden = False
    names = shown.live.world.observation().object_names
    for in_view in ((), names[1:2]):
        monkeypatch.setattr("experiments.web.worker.viewer.visible_objects", lambda *_, seen=in_view: seen)
        shown.viewer.set_view(View(640, 480, snapshots=True))
        shown.live.session.show()
        snapshot = [message for message in shown.sent if isinstance(message, Snapshot)][-1]
        assert tuple(snapshot.objects) == in_view


def test_the_display_has_no_markers_and_survives_the_way_to_the_page(shown):
    shown.drawer.hidden = False
    shown.live.session.show()
    hud = next(message for message in shown.sent if isinstance(message, Hud))
    assert hud.state.markers == () and hud.state.checklist and hud.state.clock is None
    for message in shown.sent:
        assert protocol.decode_from_worker(protocol.encode(message)) == message
        assert msgspec.json.decode(protocol.encode_to_browser(message))["type"]


def test_a_moment_names_the_room_and_what_the_action_key_would_take(shown):
    shown.drawer.hidden = False
    world, live = shown.live.world, shown.live
    shown.live.session.show()
    before = [message for message in shown.sent if isinstance(message, Moment)]
    assert before[-1].room in live.house.rooms.labels.values() and before[-1].reach is None
    seen = world.observation()
    item = live.scene.episode.objects[0]
    at = seen.object_positions[seen.object_names.index(item.name)]
    person = seen.position
    world.answer = lambda action: SimpleNamespace(
        applied=type(action).__name__ == "Pick", action=action, object=item.name, refusal=None
    )
    reach = shown.viewer._reach(live, seen)
    assert reach.object == live.house.catalogue.objects[item.model].label and reach.receptacle is None
    assert reach.at is None or all(0.0 <= share <= 1.0 for share in reach.at)
    assert at.shape == (3,) and person.shape == (2,)
