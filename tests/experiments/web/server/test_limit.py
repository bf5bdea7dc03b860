"""The queue for a slot."""

from experiments.web.server.limit import SessionLimit


def test_a_session_takes_the_slot_of_its_page_and_no_page_in_the_queue_is_passed():
    limit = SessionLimit(1)
    assert limit.ask("first", 60.0) is None
    assert limit.ask("second", 60.0) == 1 and limit.ask("third", 60.0) == 2
    assert limit.hold("first") and not limit.hold("second") and not limit.hold("newcomer")
    limit.release("first")
    assert not limit.hold("newcomer"), "two pages are before it"
    assert limit.ask("third", 60.0) == 1 and limit.ask("second", 60.0) is None
    assert limit.hold("second") and limit.ask("third", 60.0) == 1
    assert set(limit.held) == {"second"}


def test_a_slot_that_no_session_takes_goes_to_the_next_page(monkeypatch):
    now = [0.0]
    monkeypatch.setattr("experiments.web.server.limit.time.monotonic", lambda: now[0])
    limit = SessionLimit(1)
    assert limit.ask("first", 10.0) is None and limit.ask("second", 1000.0) == 1
    now[0] = 59.0
    assert limit.ask("second", 1000.0) == 1
    now[0] = 61.0
    assert limit.ask("second", 1000.0) is None and limit.ask("first", 10.0) == 1


def test_a_silent_page_gets_its_position_back(monkeypatch):
    now = [0.0]
    monkeypatch.setattr("experiments.web.server.limit.time.monotonic", lambda: now[0])
    limit = SessionLimit(1)
    assert limit.hold("first") and limit.ask("silent", 10.0) == 1 and limit.ask("next", 1000.0) == 2
    now[0] = 20.0
    assert limit.ask("next", 1000.0) == 1 and limit.waiting == 1
    assert limit.ask("silent", 10.0) == 1 and limit.ask("next", 1000.0) == 2
