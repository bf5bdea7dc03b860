"""Who plays and who waits: a queue by order of coming, and how many sessions a machine holds."""

import json
import re
import time
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import pytest
from scripted_workers import hello
from study_site import phase_of, served
from websockets.sync.client import connect

from experiments.study.payments.rules import due
from experiments.web.server import sessions
from experiments.web.server.sessions import MOST, Capacity

PHASES = 'phases = ["consent", "task", "completion"]\n'
CODES = 'completed = "C0MPLETE"\nscreened_out = "C0UT"\nno_consent = "C0NO"\n'


def at_the_task(site, client, number=0):
    """Somebody who asks for the page of the task: the link."""
    link = site.begin(client, **ids(number))
    agree(client, link)
    return link


def ids(number):
    person, session = f"person{number:06}", f"session{number:06}"
    return {"PROLIFIC_PID": person, "STUDY_ID": "study000001", "SESSION_ID": session}


def agree(client, link):
    client.post(link, data={"phase": "consent", "agree": "yes"})


def place(client, link):
    """Position in the queue, by the page; None for somebody whose task may run."""
    text = client.get(link).text
    if "data-trial" in text:
        return None
    assert re.search(r'<noscript><meta http-equiv="refresh" content="\d+"></noscript>', text)
    return int(re.search(r"number (\d+) in the queue", text)[1])


def leave(client, link):
    assert client.post(f"{link}/withdrawal", data={"data": "keep"}).status_code == 303


@pytest.fixture
def crowd(tmp_path, monkeypatch):
    """A study with one place, and four people at the task; the first one has it."""
    monkeypatch.setattr("experiments.visit.server.trials.REFRESH", (1.0, 1.0))
    recruitment = f'[study.recruitment]\nplatform = "prolific"\n{CODES}'
    with served(tmp_path, PHASES + recruitment, workers=1) as site, site.client() as client:
        links = [at_the_task(site, client, number) for number in range(4)]
        yield site, client, links


@pytest.mark.slow
def test_people_wait_in_order_and_keep_their_place(crowd):
    site, client, links = crowd
    assert [place(client, link) for link in links] == [None, 1, 2, 3]
    assert "time limit keeps running" in client.get(links[3]).text
    with site.client(researcher=True) as researcher:
        sessions = researcher.get("/health").json()["sessions"]
        assert sessions == {"capacity": 1, "in_use": 1, "waiting": 3}
        assert "mjsim_sessions_waiting 3.0" in researcher.get("/metrics").text
    address = site.url.replace("http", "ws", 1).rstrip("/") + links[0]
    with connect(address, origin=site.url.rstrip("/")) as socket:
        socket.send(json.dumps(hello("task")))
        while json.loads(socket.recv(timeout=20)).get("phase") != "ready":
            pass
        assert place(client, links[1]) == 1, "a place that is in use stays so"
        time.sleep(1.5)
        assert [place(client, link) for link in links[2:]] == [2, 3]
        leave(client, links[0])
    time.sleep(1.5)  # the second person is silent, so that others go first
    assert [place(client, links[number]) for number in (3, 2)] == [1, None]
    assert [place(client, links[number]) for number in (1, 3)] == [1, 2], "who comes back is where they were"


def test_the_expected_wait_follows_from_trials_that_ended(crowd):
    site, client, links = crowd
    assert place(client, links[0]) is None
    assert "about 25 min" in client.get(links[1]).text
    address = site.url.replace("http", "ws", 1).rstrip("/") + links[0]
    with connect(address, origin=site.url.rstrip("/")) as socket:
        socket.send(json.dumps(hello("task")))
        socket.send(json.dumps({"type": "run", "until": None}))
        for said in (
            {"type": "run", "until": None},
            {"type": "inputs", "inputs": [{"number": 1, "scroll": 100}]},
        ):
            while json.loads(socket.recv(timeout=20)).get("phase") not in ("ready", "running"):
                pass
            socket.send(json.dumps(said))
        while json.loads(socket.recv(timeout=20))["type"] != "saved":
            pass
    assert phase_of(client, links[0]) is None
    assert place(client, links[1]) is None
    assert "about 1 min" in client.get(links[2]).text


def test_where_places_fill_up_people_leave_by_the_platform_and_are_paid_by_rule(tmp_path, monkeypatch):
    for name in ("COUNTED", "COUNTED_FULL"):
        monkeypatch.setattr(f"experiments.visit.server.admission.{name}", 0.0)
    pay = "[study.pay]\nreward = 6.0\nscreen_out = 0.5\npartial = true\n"
    recruitment = f'[study.recruitment]\nplatform = "prolific"\n{CODES}'
    with served(tmp_path, PHASES + pay + recruitment) as site, site.client() as client:
        site.ask(site.store.set_quota(0, 2, "test"))
        links = [site.begin(client, **ids(number)) for number in range(3)]
        agree(client, links[0])
        agree(client, links[1])
        assert "Enough people have already" in client.get("/", params=ids(3)).text, "two are on their way"
        closed = client.post("/begin", data=ids(3))
        assert "return the task" in closed.text and "location" not in closed.headers
        assert place(client, links[0]) is place(client, links[1]) is None
        agree(client, links[2])
        for _ in range(2):  # also when the page is loaded again
            left = client.get(links[2]).text
            assert "All places are taken" in left and "cc=C0UT" in left
        people = site.ask(site.store.people())
        assert [one.status for one in people] == ["assigned", "assigned", "screened_out"]
        owed = {payment.key: payment.cents for payment in due(site.study, people, ())}
        assert owed == {"p00003-screen_out": 50, "p00003-bonus": 150}  # a third of the reward, after a third
        leave(client, links[0])
        assert "Enough people" not in client.get("/", params=ids(3)).text, "there is a place again"


def test_a_place_that_is_given_back_after_the_last_one_was_taken_is_offered_at_once(tmp_path):
    """The number of free places is kept for ten seconds only while there are some."""
    recruitment = f'[study.recruitment]\nplatform = "prolific"\n{CODES}'
    with served(tmp_path, PHASES + recruitment) as site, site.client() as client:
        site.ask(site.store.set_quota(0, 2, "test"))
        first, _ = (site.begin(client, **ids(number)) for number in range(2))
        leave(client, first)
        assert "Enough people" not in client.get("/", params=ids(2)).text
        assert site.begin(client, **ids(2))


def test_no_more_people_come_within_seconds_than_places_were_counted(tmp_path):
    """The number of free places is kept for ten seconds, but each new person reduces it."""
    recruitment = f'[study.recruitment]\nplatform = "prolific"\n{CODES}'
    with served(tmp_path, PHASES + recruitment) as site, site.client() as client:
        site.ask(site.store.set_quota(0, 2, "test"))
        for number in range(2):
            assert "Enough people" not in client.get("/", params=ids(number)).text
            agree(client, site.begin(client, **ids(number)))
        assert "Enough people" in client.post("/begin", data=ids(2)).text
        assert len(site.ask(site.store.people())) == 2


def test_only_new_people_count_towards_the_limit_of_an_address(tmp_path, monkeypatch):
    monkeypatch.setattr("experiments.visit.server.admission.NEW_PEOPLE", (3, 60.0))
    recruitment = f'[study.recruitment]\nplatform = "prolific"\n{CODES}'
    with served(tmp_path, PHASES + recruitment) as site, site.client() as client:
        with ThreadPoolExecutor(8) as threads:
            links = set(threads.map(lambda _: site.begin(client, **ids(0)), range(20)))
        assert len(links) == 1, "many requests of one person at once"
        assert {site.begin(client, **ids(number)) for number in (0, 1, 0, 2, 0, 1)} > links
        refused = client.post("/begin", data=ids(3))
        assert refused.status_code == 429 and 'value="person000003"' in refused.text
        assert refused.headers["retry-after"] == "60"
        assert site.begin(client, **ids(2)), "who has begun may always return"
    monkeypatch.undo()


def test_a_person_who_asks_twice_at_once_counts_once(tmp_path, monkeypatch):
    """No request sees in the database that another one has just begun the visit."""

    async def nobody(*_):
        return None

    monkeypatch.setattr("experiments.visit.server.admission.NEW_PEOPLE", (3, 60.0))
    monkeypatch.setattr("experiments.visit.server.admission.Admission._known", nobody)
    recruitment = f'[study.recruitment]\nplatform = "prolific"\n{CODES}'
    with served(tmp_path, PHASES + recruitment) as site, site.client() as client:
        assert len({site.begin(client, **ids(number)) for number in (0, 0, 1, 1, 0, 2)}) == 3
        assert client.post("/begin", data=ids(3)).status_code == 429


def test_a_machine_lets_in_as_many_as_its_cores_hold(monkeypatch):
    clock = SimpleNamespace(now=0.0)
    clock.monotonic, clock.process_time = (lambda: clock.now), (lambda: 0.0)
    monkeypatch.setattr(sessions, "time", clock)
    machine = Capacity(cores=4)
    assert machine.measure({}, ()) == 8, "sessions may need a third of a core, until more is known"
    playing = {str(number): SimpleNamespace(processor_time=0.0) for number in range(8)}
    assert machine.measure(playing, playing.keys()) == 8

    def after(seconds, share):
        clock.now += seconds
        for session in playing.values():
            session.processor_time += share * seconds
        return machine.measure(playing, playing.keys())

    assert after(5.0, 1 / 25) == 8 + int((0.7 * 4 - 8 / 25) / MOST)
    assert after(5.0, 0.5) == 8, "they need more than there is: nobody is let in, and nobody has to leave"
    clock.process_time = lambda: 0.9 * clock.now
    for _ in range(6):
        assert after(5.0, 0.01) == 8, "the server has no time for more"
    used = clock.process_time()
    clock.process_time = lambda: used
    assert after(5.0, 0.01) == 8 + int((0.7 * 4 - 8 * 0.01) / MOST)
