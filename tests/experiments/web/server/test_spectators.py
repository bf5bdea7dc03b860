"""Who watches a session sees its present state first, then all that its page sees."""

from experiments.web.protocol import Taken
from experiments.web.server.spectators import Spectators
from experiments.web.state import RUNNING, GaitParameters, Pictures, SceneMessage, Snapshot, Speeds, State

GAIT, SPEEDS = GaitParameters(*[1.0] * 22), Speeds(1.0, 1.0, 1.0)
SCENE = SceneMessage("/scene/0123/", None, GAIT, SPEEDS, 1.5, None, 0.04)


class Page:
    def __init__(self):
        self.told, self.closed = [], False

    def send(self, message):
        self.told.append(message)

    def close(self, *_):
        self.closed = True


def snapshot(step, objects, models=None, gone=()):
    hands = (None, None)
    return Snapshot(step, 0, step / 25, False, [], [], [], hands, objects, models or {}, list(gone))


def watched(*messages):
    spectators = Spectators()
    for message in messages:
        spectators.tell(message)
    return spectators


def test_who_comes_later_is_told_what_is_known_by_then():
    spectators = watched(
        SCENE,
        Pictures({}, {}),
        State(RUNNING),
        snapshot(1, {"cup": [1.0], "book": [2.0]}, {"cup": "mug", "book": "novel"}),
        snapshot(2, {"cup": [3.0]}, gone=["book"]),
        Taken(7, 2),
    )
    page = Page()
    spectators.join(page)
    assert page.told == [State(RUNNING), SCENE, Pictures({}, {}), snapshot(2, {"cup": [3.0]}, {"cup": "mug"})]
    spectators.tell(following := snapshot(3, {"cup": [4.0]}))
    spectators.tell(Taken(8, 3))
    assert page.told[4:] == [following]
    spectators.leave(page)
    spectators.tell(snapshot(4, {}))
    assert page.told[4:] == [following]


def test_a_page_that_connects_again_is_told_anew_and_so_are_those_who_watch():
    spectators = watched(SCENE, snapshot(1, {"cup": [1.0]}, {"cup": "mug"}), SCENE)
    page = Page()
    spectators.join(page)
    assert page.told == [SCENE]


def test_a_session_that_stops_closes_the_pages_of_those_who_watch():
    spectators, page = Spectators(), Page()
    spectators.join(page)
    spectators.close()
    assert page.closed
