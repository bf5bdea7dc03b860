"""`mjsim play` in front of a worker that is scripted: links, checks, messages, the visit."""

import asyncio
import json
import re
import sqlite3
import time
from contextlib import closing, contextmanager
from datetime import datetime, timedelta
from pathlib import Path

import pytest
from play_site import arguments_of, begin, play_app, playing, send
from scripted_workers import (
    METRICS,
    ORIGIN,
    ScriptedPool,
    connected,
    hello,
    left,
    play_trial,
    started,
    until,
    until_phase,
)
from starlette.responses import PlainTextResponse
from starlette.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

from experiments.cli.play import task_of
from experiments.house import House
from experiments.record.run_directory import VISIT
from experiments.visit.folders import VisitFolders
from experiments.visit.tokens import new_token, token_hash
from experiments.web import protocol
from experiments.web.protocol import FrameMessage, Inputs, Open, Pause, Taken
from experiments.web.server.guards import Guards, allowed_hosts
from experiments.web.server.played_session import MAX_CRASHES
from experiments.web.server.pool import HOUSE, SETTINGS, WorkerPool
from experiments.web.state import PAUSED, GaitParameters, SceneMessage, Snapshot, Speeds, State

GAIT, SPEEDS = GaitParameters(*[1.0] * 22), Speeds(1.0, 1.0, 1.0)
SCENE = SceneMessage("/scene/0123/", None, GAIT, SPEEDS, 1.5, None, 0.04)


@pytest.fixture
def pool():
    return ScriptedPool()


@pytest.fixture
def client(tmp_path, pool):
    with playing(tmp_path, pool) as client:
        yield client


def new_visit(client, **form):
    """Begin a visit and read the story; its link."""
    link = begin(client, **form)
    assert 'data-trial="' in client.get(link).text
    return link


def go_through(client, link):
    """Training and task, each left at once."""
    for phase in ("training", "task"):
        play_trial(client, link, phase)


def inputs(*numbers, **values):
    return {"type": "inputs", "inputs": [{"number": number, **values} for number in numbers]}


def before_the_task(pool):
    """What the worker was told of the phases before the task."""
    opened = [told for told in pool.workers[0].told if isinstance(told, Open)]
    assert [told.before for told in opened[:-1]] == [[]] * (len(opened) - 1)
    return opened[-1].before


def test_a_visit_from_the_story_to_the_result(client, pool):
    assert "Tidy the apartment" in client.get("/").text
    link = begin(client, read=False)
    assert "You are a guest" in client.get(link).text
    send(client, link, "story")
    for phase in ("training", "task"):
        assert f'data-trial="{phase}"' in client.get(link).text
        with connected(client, link) as socket:
            started(socket, phase)
            socket.send_json(inputs(1, forward=1.0))
            assert until(socket, "taken")[-1]["input"] == 1
            socket.send_json({"type": "leave"})
            assert until_phase(socket, "over")["reason"] == "all delivered"
            until(socket, "saved")
    text = client.get(link).text
    for shown in ("6 of 6", "2 min 5 s", "70 m", "3.2 m", "0.93", "2 of your choices"):
        assert shown in text
    assert len(pool.workers) == 1  # the same worker for training and task
    asked = [told for told in pool.workers[0].told if isinstance(told, Open)]
    assert [opened.config["objects"] for opened in asked] == [1, 6]
    assert [opened.floor_plan for opened in asked] == [False, True]


def test_who_did_nothing_has_a_result_without_an_inverse_path_length(client, monkeypatch):
    for name in ("ipl_locations", "total_regret_m"):
        monkeypatch.setitem(METRICS, name, None)
    link = new_visit(client)
    go_through(client, link)
    answer = client.get(link)
    assert answer.status_code == 200
    assert "Your result" in answer.text and "Inverse path length" not in answer.text


def test_the_story_says_the_same_under_all_conditions_but_what_they_show(tmp_path, pool):
    """What is said under none is said under all; what is shown in addition follows, and plans come last."""

    def said(name):
        with playing(tmp_path / name, pool, "--assistance", name) as client:
            text = client.get(begin(client, read=False)).text
        return re.findall(r"<p>(.*?)</p>", text[text.index("<p>A list") : text.index("<form")], re.DOTALL)

    none, highlight, optimal = (said(name) for name in ("none", "highlight", "optimal"))
    assert len(none) == 2 and said("guided-minimap") == optimal
    assert (highlight[:1] + highlight[2:], optimal[:2] + optimal[3:]) == (none, highlight)


def test_a_film_comes_first_where_there_is_one(tmp_path, pool):
    film = tmp_path / "film.mp4"
    film.write_bytes(b"0123456789")
    with playing(tmp_path / "visits", pool, "--film", str(film)) as client:
        link = begin(client)
        assert "<video" in client.get(link).text
        assert client.get(f"{link}/film", headers={"Range": "bytes=2-4"}).content == b"234"
        assert send(client, link, "flythrough").status_code == 303
        assert 'data-trial="training"' in client.get(link).text
        go_through(client, link)
    story, watched, trained = before_the_task(pool)
    assert (story["phase"], watched["phase"]) == ("story", "flythrough")
    assert 0.0 < story["duration_s"] < 10.0 and 0.0 < watched["duration_s"] < 10.0
    assert trained == {"phase": "training", "duration_s": 125.0, "reason": "all delivered"}


def test_only_the_hash_of_a_token_is_kept(client, tmp_path, caplog):
    caplog.set_level("INFO")
    link = new_visit(client)
    play_trial(client, link, "training")
    token = link.removeprefix("/play/")
    text = "".join(one.getMessage() for one in caplog.records if one.name.startswith("mjsim"))
    assert token not in text and token_hash(token)[:12] in text
    assert (tmp_path / token_hash(token) / VISIT).is_file()
    files = [path for path in tmp_path.rglob("*") if path.is_file()]
    assert len(files) > 2 and not [path for path in files if token.encode() in path.read_bytes()]


@pytest.mark.parametrize("token", ["x", "x" * 43, "%2e%2e", "..%2f..%2fetc", "a" * 5000, "%00", "é" * 43])
def test_an_unknown_token_is_no_visit(client, token):
    assert client.get(f"/play/{token}").status_code == 404
    with pytest.raises(WebSocketDisconnect), connected(client, f"/play/{token}"):
        pass


@pytest.mark.parametrize("path", ["../server.py", "%2e%2e/server.py", "..%2fserver.py", "/etc/passwd", ""])
def test_static_files_cannot_be_left(client, path):
    assert client.get(f"/static/{path}").status_code == 404


def test_every_answer_has_strict_headers_and_no_script_or_style_of_its_own(client):
    for path in ("/", "/nothing", "/static/play.js", "/static/nothing", new_visit(client)):
        answer = client.get(path)
        policy = answer.headers["content-security-policy"]
        assert "default-src 'none'" in policy and "script-src 'self';" in policy and "unsafe" not in policy
        assert answer.headers["x-content-type-options"] == "nosniff"
        assert answer.headers["x-frame-options"] == "DENY"
        if not path.startswith("/static"):
            own = ("<script>", "<style", " style=", " onclick", "http:", "https:")
            assert not [name for name in own if name in answer.text]


def test_files_are_cached_and_pages_are_not(tmp_path, pool):
    film = tmp_path / "film.mp4"
    film.write_bytes(b"0123456789")
    with playing(tmp_path / "visits", pool, "--film", str(film)) as client:
        link = begin(client)
        for path, cached in (("/", False), (link, False), ("/static/play.js", True), (f"{link}/film", True)):
            headers = client.get(path).headers
            assert ("no-store" not in headers["cache-control"]) is cached
            assert not cached or headers["etag"]
        tag = client.get("/static/play.js").headers["etag"]
        assert client.get("/static/play.js", headers={"If-None-Match": tag}).status_code == 304
        text = client.get(link).text
        (address,) = re.findall(r'<script type="module" src="(/static/[0-9a-f]{16}/study/film.js)">', text)
        answer = client.get(address)
        assert answer.status_code == 200 and "immutable" in answer.headers["cache-control"]
        assert f'href="{address.replace("study/film.js", "style.css")}"' in text


@pytest.fixture
def few(monkeypatch):
    """One address may begin 6 visits a minute."""
    monkeypatch.setattr("experiments.visit.server.admission.NEW_PEOPLE", (6, 60.0))


PROXY, SPOOF = "203.0.113.9", "198.51.100."


@pytest.mark.usefixtures("few")
@pytest.mark.parametrize(
    ("peer", "forwarded", "begun"),
    [
        ("192.0.2.7", SPOOF + "{}", 6),  # no proxy: its word is nothing
        (PROXY, "192.0.2.7", 6),
        (PROXY, SPOOF + "{}, 192.0.2.7", 6),  # what the proxy did not write is nothing
        (PROXY, SPOOF + "{}", 9),  # people behind the proxy have limits of their own
        (PROXY, "2001:db8::{}", 6),  # one machine has all addresses of its network
        (PROXY, "unknown, {}, x", 6),
    ],
)
def test_limits_hold_for_the_address_that_a_trusted_proxy_saw(tmp_path, pool, peer, forwarded, begun):
    app = play_app(tmp_path, pool, "--trusted-proxy", f"10.0.0.0/8,{PROXY}")
    with TestClient(app, base_url=ORIGIN, follow_redirects=False, client=(peer, 1)) as client:
        headers = [{"Origin": ORIGIN, "X-Forwarded-For": forwarded.format(i)} for i in range(9)]
        answers = [client.post("/begin", headers=sent).status_code for sent in headers]
    assert answers.count(303) == begun and answers.count(429) == 9 - begun


OWN_HOSTS = "127.0.0.1:8000", "localhost:8000", "[::1]:8000"
OTHER_HOSTS = "evil.example", "192.168.7.9:8000", "", "user@127.0.0.1:8000", "127.0.0.1:x", "[::1"


@pytest.mark.parametrize("host", OWN_HOSTS + OTHER_HOSTS)
def test_only_own_addresses_are_served(client, host):
    assert client.get("/", headers={"Host": host}).status_code == (200 if host in OWN_HOSTS else 400)


@pytest.mark.parametrize("host", ["[fe80::1%;script-src *]", "a;b", "a b", "[::1", ""])
def test_an_odd_host_reaches_no_content_security_policy(host):
    answer = TestClient(Guards(PlainTextResponse("a page"), None)).get("/", headers={"Host": host})
    assert answer.status_code == 400 and "script-src *" not in answer.headers["content-security-policy"]


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "null", "", "http://127.0.0.1:9999", "https://127.0.0.1:8000"]
)
def test_another_origin_is_refused(client, origin):
    link = new_visit(client)
    assert client.post("/begin", headers={"Origin": origin}).status_code == 403
    with pytest.raises(WebSocketDisconnect), connected(client, link, origin):
        pass


def test_a_server_for_the_network_is_reached_at_the_addresses_of_the_machine():
    assert "192.168.7.9" in allowed_hosts("192.168.7.9", None)
    names = allowed_hosts("0.0.0.0", None)
    assert {"localhost", "127.0.0.1", "[::1]", "0.0.0.0"} <= set(names) and "*" not in names


def test_a_proxy_may_make_it_public(tmp_path, pool):
    public = "https://play.example.org"
    app = play_app(tmp_path, pool, "--public-url", public)
    with TestClient(app, base_url=public, follow_redirects=False) as client:
        assert client.post("/begin", headers={"Origin": public}).status_code == 303
        assert client.post("/begin", headers={"Origin": ORIGIN}).status_code == 403
        assert (
            "connect-src 'self' blob: wss://play.example.org;"
            in client.get("/").headers["content-security-policy"]
        )
        assert client.get("/", headers={"Host": "other.example.org"}).status_code == 400


@pytest.mark.usefixtures("few")
def test_large_bodies_and_many_visits_are_refused(client):
    assert client.post("/begin", headers={"Origin": ORIGIN}, content=b"x" * 70000).status_code == 413
    answers = [client.post("/begin", headers={"Origin": ORIGIN}).status_code for _ in range(9)]
    assert answers.count(303) == 6 and answers.count(429) == 3


@pytest.mark.parametrize(
    ("message", "code"),
    [
        (b"\0" * 100, "malformed"),
        ("", "malformed"),
        ("[" * 50000, "malformed"),
        ('"hello"', "malformed"),
        ('{"type":"open","folder":"/","run":"/"}', "malformed"),
        ('{"type":"seen","frame":-1}', "malformed"),
        (json.dumps({"type": "pause", "reason": "y" * 41}), "malformed"),
        ('{"type":"run","more":1}', "malformed"),
        ('{"type":"inputs","inputs":[{"number":1,"forward":2}]}', "malformed"),
        ('{"type":"inputs","inputs":[{"number":1,"forward":NaN}]}', "malformed"),
        (json.dumps(inputs(*range(1, 70))), "malformed"),
        (json.dumps(inputs(2, 1)), "out of order"),
        (json.dumps(inputs(1, 1)), "out of order"),
        (json.dumps(inputs(2**53)), "out of order"),
        (json.dumps(inputs(1001)), "out of order"),
        (json.dumps(hello()), "out of order"),
        ('{"type":"takeover"}', "out of order"),
    ],
)
def test_a_bad_message_gets_a_typed_error_and_stops_nothing(client, message, code):
    with connected(client, new_visit(client)) as socket:
        started(socket)
        socket.send_bytes(message) if isinstance(message, bytes) else socket.send_text(message)
        error = until(socket, "error")[-1]
        assert error["code"] == code and "Traceback" not in error["message"]
        socket.send_json(inputs(1))
        assert until(socket, "taken")[-1]["input"] == 1


def test_messages_may_come_too_early(client):
    with connected(client, new_visit(client)) as socket:
        for message in ({"type": "run"}, inputs(1), {"type": "seen", "frame": 1}, {"type": "takeover"}):
            socket.send_json(message)
            assert socket.receive_json()["code"] == "too early"
        socket.send_json(hello())
        until_phase(socket, "ready")
        socket.send_json(inputs(1))
        assert until(socket, "error")[-1]["code"] == "too early"


def test_a_flood_is_cut_off_and_others_are_not_disturbed(tmp_path, pool):
    with (
        playing(tmp_path, pool) as client,
        connected(client, new_visit(client)) as quiet,
        connected(client, new_visit(client)) as loud,
    ):
        started(quiet)
        started(loud)
        with pytest.raises(WebSocketDisconnect) as closed:
            for _ in range(2000):
                loud.send_json({"type": "run"})
            until(loud, "nothing")
        assert closed.value.code == protocol.TOO_MUCH
        quiet.send_json(inputs(1))
        assert until(quiet, "taken")[-1]["input"] == 1


def test_inputs_are_bound_by_those_that_were_taken(client, pool, monkeypatch):
    monkeypatch.setattr("experiments.web.server.played_session.MAX_AHEAD", 100)
    with connected(client, new_visit(client)) as socket:
        started(socket)
        pool.workers[0]._answers.put_nowait = lambda _: None  # nothing is taken any more
        for first in (1, 51, 101):
            socket.send_json(inputs(*range(first, first + 50)))
        assert until(socket, "error")[-1]["code"] == "out of order"


def test_presses_without_end_are_cut_off(client):
    with connected(client, new_visit(client)) as socket, pytest.raises(WebSocketDisconnect) as closed:
        started(socket)
        for first in range(1, 64 * 40, 64):
            socket.send_json(inputs(*range(first, first + 64), press="act"))
        until(socket, "nothing")
    assert closed.value.code == protocol.TOO_MUCH


@contextmanager
def full_address(client):
    """Other visits have as many sockets open at the client's address as it may have."""
    sockets = client.server._trials._sockets
    (address,) = (name for name in sockets if len(name) < 64)  # others are hashes of links
    before, sockets[address] = sockets[address], 4
    yield
    sockets[address] = before


def test_a_visit_and_an_address_have_few_sockets(tmp_path, pool, monkeypatch):
    monkeypatch.setattr("experiments.visit.server.trials.SOCKETS_OF_AN_ADDRESS", 2)
    with playing(tmp_path, pool, sessions=2) as client:
        link, other = new_visit(client), new_visit(client)
        with connected(client, link), connected(client, link), connected(client, other):
            with pytest.raises(WebSocketDisconnect), connected(client, link):
                pass
            with connected(client, other):  # all who can play may be at one address, and load pages again
                pass
            with full_address(client), pytest.raises(WebSocketDisconnect), connected(client, other):
                pass
        with connected(client, link) as socket:
            started(socket)


def test_one_damaged_visit_does_not_keep_the_server_from_starting(tmp_path, pool, caplog):
    with playing(tmp_path, pool) as client:
        damaged, whole = new_visit(client), new_visit(client)
    (tmp_path / token_hash(damaged[6:]) / VISIT).write_text("{")
    unknown = tmp_path / ("0" * 64)
    unknown.mkdir()
    (unknown / VISIT).write_text("{")
    with playing(tmp_path, pool) as client:
        assert client.get(damaged).status_code == 503
        play_trial(client, whole, "training")
    assert caplog.text.count("is damaged") >= 3


def test_a_server_without_the_film_leads_on_who_was_to_see_it(tmp_path, pool):
    (tmp_path / "film.mp4").write_bytes(b"film")
    with playing(tmp_path / "visits", pool, "--film", str(tmp_path / "film.mp4")) as client:
        link = begin(client)
        assert "This video" in client.get(link).text
    with playing(tmp_path / "visits", pool) as client:
        assert 'data-trial="training"' in client.get(link).text


def test_a_page_is_told_twice_a_second_that_the_server_lives(client):
    with connected(client, new_visit(client)) as socket:
        started(socket)
        until(socket, "beat")
        began = time.perf_counter()
        until(socket, "beat")
        assert time.perf_counter() - began < 1.0


def test_who_answers_occupied_with_nothing_is_sent_away(client, monkeypatch):
    monkeypatch.setattr("experiments.web.server.browser_socket.CLOSE_TIMEOUT", 0.01)
    monkeypatch.setattr("experiments.web.server.browser_socket.OCCUPIED_TIMEOUT", 0.1)
    link = new_visit(client)
    with connected(client, link) as first, connected(client, link) as second:
        started(first)
        second.send_json(hello(tab="tab-00000002"))
        assert until(second, "error")[-1]["code"] == "idle"


def test_visits_have_orders_of_their_own_and_folders_that_nobody_else_reads(client, tmp_path):
    folders = [VisitFolders(tmp_path).find(token_hash(new_visit(client)[6:])) for _ in range(3)]
    assert [folder.settings("task")["order_seed"] for folder in folders] == [0, 1, 2]
    assert all(folder.path.stat().st_mode & 0o077 == 0 for folder in folders)


def test_who_has_seen_the_best_way_plays_another_episode(client, tmp_path):
    def house_seed(link):
        return VisitFolders(tmp_path).find(token_hash(link[6:])).settings("task")["house_seed"]

    link = new_visit(client)
    assert house_seed(new_visit(client, after=link[6:])) == 0, "that visit is not over"
    go_through(client, link)
    for expected in (1, 2):
        again = re.search(r'href="(/\?after=[\w-]+)"', client.get(link).text)[1]
        after = re.search(r'name="after" value="([\w-]+)"', client.get(again).text)[1]
        link = new_visit(client, after=after)
        assert house_seed(link) == expected
        go_through(client, link)


@pytest.mark.parametrize("after", ["", "x", "A" * 43, '"><script>'])
def test_another_episode_needs_the_link_of_a_visit(tmp_path, pool, after):
    with playing(tmp_path, pool) as client:
        assert '"><script>' not in client.get("/", params={"after": after}).text
        token = new_visit(client, after=after)[6:]
        assert VisitFolders(tmp_path).find(token_hash(token)).settings("task")["house_seed"] == 0


def test_a_fixed_episode_is_not_offered_again(tmp_path, pool):
    episode = tmp_path / "episode.json"
    episode.write_text(House.load("apartment").sample_episode(objects=3, seed=0).to_json())
    with playing(tmp_path / "visits", pool, "--episode", str(episode)) as client:
        link = new_visit(client)
        go_through(client, link)
        assert "Play again" not in client.get(link).text


QUESTIONS = """
[[question]]
text = "How many things at a time?"
choices = ["one", "two"]
answer = "two"

[[question]]
text = "Why?"
choices = ["a", "b"]
answer = "a"
"""


def ago(store_folder, seconds):
    """Let all phases have been shown earlier."""
    with closing(sqlite3.connect(store_folder / "study.db")) as database:
        for row, shown in database.execute("SELECT id, shown FROM phase").fetchall():
            earlier = datetime.fromisoformat(shown) - timedelta(seconds=seconds)
            database.execute("UPDATE phase SET shown = ? WHERE id = ?", (str(earlier), row))
        database.commit()


def test_a_story_is_read_for_its_time(tmp_path, pool):
    with playing(tmp_path, pool, "--minimum", "story=30") as client:
        link = begin(client, read=False)
        page = client.get(link)
        assert float(re.search(r'data-wait="([\d.]+)"', page.text)[1]) > 29.0
        early = send(client, link, "story")
        assert early.status_code == 303 and "take the time" in client.get(link).text
        ago(tmp_path, 31.0)
        assert send(client, link, "story").status_code == 303, "the time so far counts"


def test_questions_about_the_story_are_answered_as_often_as_needed(tmp_path, pool):
    (tmp_path / "questions.toml").write_text(QUESTIONS)
    with playing(tmp_path, pool, "--questions", str(tmp_path / "questions.toml")) as client:
        link = begin(client)
        for wrong in ({}, {"question_1": "two"}, {"question_1": "one", "question_2": "a"}):
            assert send(client, link, "comprehension", **wrong).status_code == 303
            page = client.get(link)
            assert 'role="alert"' in page.text and "Attempts left" not in page.text
        assert "Some answers are wrong" in page.text
        assert send(client, link, "comprehension", question_1="two", question_2="a").status_code == 303
        assert 'data-trial="training"' in client.get(link).text


def test_film_and_training_last_their_time(tmp_path, pool):
    (tmp_path / "film.mp4").write_bytes(b"film")
    words = ("--film", str(tmp_path / "film.mp4"), "--minimum", "flythrough=10,training=20")
    with playing(tmp_path, pool, *words) as client:
        link = begin(client)
        for _ in range(2):
            assert "This video" in client.get(link).text, "it is not over yet"
            send(client, link, "flythrough")
        ago(tmp_path, 11.0)
        send(client, link, "flythrough")
        assert 'data-trial="training"' in client.get(link).text
        with connected(client, link) as socket:
            started(socket)
            socket.send_json({"type": "leave"})
            assert until(socket, "error")[-1]["code"] == "too early"
        ago(tmp_path, 21.0)
        client.portal.call(client.release)
        with connected(client, link) as socket:
            started(socket)
            left(socket)
        assert 'data-trial="task"' in client.get(link).text


def test_a_participant_may_leave_and_have_everything_deleted(client, tmp_path):
    link = new_visit(client)
    play_trial(client, link, "training")
    assert "Leave and delete my data" in client.get(f"{link}/withdrawal").text
    client.post(f"{link}/withdrawal", headers={"Origin": ORIGIN}, data={"data": "delete"})
    assert "You have left" in client.get(link).text and not list(tmp_path.glob("*/visit.json"))


def test_pages_are_in_the_language_that_was_asked_for(tmp_path, pool):
    with playing(tmp_path, pool, "--language", "de") as client:
        assert "Räumen Sie die Wohnung auf" in client.get("/").text
        link = new_visit(client)
        go_through(client, link)
        assert "Ihr Ergebnis" in client.get(link).text and "6 von 6" in client.get(link).text


@pytest.mark.parametrize(
    ("here", "shown"),
    [("flythrough", "This video"), ("training", 'data-trial="training"'), ("task", 'data-trial="task"')],
)
def test_folders_of_visits_from_before_the_database_continue(tmp_path, pool, here, shown):
    (tmp_path / "film.mp4").write_bytes(b"film")
    token, phases = new_token(), ["flythrough", "training", "task"]
    folder = tmp_path / "visits" / token_hash(token)
    folder.mkdir(parents=True)
    ended = [{"phase": "story", "duration_s": 12.5}]
    ended += [{"phase": "flythrough", "duration_s": 3.0}] * (here != "flythrough")
    if here == "task":
        (folder / "training").mkdir()
        (folder / "training" / "metrics.json").write_text(json.dumps(METRICS))
        ended.append({"phase": "training", "duration_s": 125.0, "reason": "all delivered"})
    settings = {**task_of(arguments_of()).settings(), "order_seed": 17}
    stored = {"phase": here, "phases": phases, "trials": {"training": settings, "task": settings}}
    (folder / VISIT).write_text(json.dumps({**stored, "ended": ended, "shown": 5.0, "version": 1}))
    with playing(tmp_path / "visits", pool, "--film", str(tmp_path / "film.mp4")) as client:
        link = f"/play/{token}"
        assert shown in client.get(link).text
        if here == "flythrough":
            send(client, link, "flythrough")
            client.get(link)
        for trial in phases[phases.index(here if here != "flythrough" else "training") :]:
            play_trial(client, link, trial)
        assert "Your result" in client.get(link).text
    opened = [told for told in pool.workers[-1].told if isinstance(told, Open)]
    assert [told.config["order_seed"] for told in opened] == [17] * len(opened)
    assert [(one["phase"], one["duration_s"]) for one in opened[-1].before][-1] == ("training", 125.0)
    assert opened[-1].before[0] == {"phase": "story", "duration_s": 12.5}


def test_a_worker_that_died_is_named_to_the_next(client, pool):
    with connected(client, new_visit(client)) as socket:
        started(socket)
        pool.workers[0].die()
        until_phase(socket, "ready")
    assert [worker.told[0].restarted for worker in pool.workers] == [False, True]


def test_inputs_that_follow_others_lost_with_a_worker_are_not_taken_before_these(client, pool):
    with connected(client, new_visit(client)) as socket:
        started(socket)
        socket.send_json(inputs(1))
        until(socket, "taken")
        pool.workers[0].die()
        until_phase(socket, "ready")
        pool.workers[1].say(State(PAUSED, "interrupted", input=1))
        until_phase(socket, "paused")
        socket.send_json(inputs(3))  # sent before the page knew
        socket.send_json(inputs(2, 3))
        assert until(socket, "taken")[-1]["input"] == 3
    told = [[new.number for new in said.inputs] for said in pool.workers[1].told if isinstance(said, Inputs)]
    assert told == [[2, 3]]


def test_a_second_page_takes_over_by_asking_and_the_first_is_told(client, monkeypatch):
    monkeypatch.setattr("experiments.web.server.browser_socket.CLOSE_TIMEOUT", 0.1)
    link = new_visit(client)
    with connected(client, link) as first:
        started(first)
        with connected(client, link) as second:
            second.send_json(hello(tab="tab-00000002"))
            assert second.receive_json()["type"] == "occupied"
            first.send_json(inputs(1))
            assert until(first, "taken")[-1]["input"] == 1
            second.send_json({"type": "takeover"})
            assert until(first, "replaced")
            with pytest.raises(WebSocketDisconnect) as closed:
                first.receive_json()
            assert closed.value.code == protocol.REPLACED
            state = until_phase(second, "paused")
            assert state["reason"] == "taken over" and state["input"] == 1


def test_a_page_that_connects_again_need_not_ask(client):
    link = new_visit(client)
    with connected(client, link) as first:
        started(first)
        with connected(client, link) as second:
            second.send_json(hello())
            assert until_phase(second, "paused")["reason"] == "disconnected"


def test_without_a_browser_the_session_is_paused(client, pool):
    link = new_visit(client)
    with connected(client, link) as socket:
        started(socket)
        socket.send_json(inputs(1))
        until(socket, "taken")
    with connected(client, link) as socket:
        socket.send_json(hello(tab="tab-00000002"))
        assert until_phase(socket, "paused")["reason"] == "disconnected"
    assert Pause("disconnected") in pool.workers[0].told


def test_workers_that_die_again_and_again_are_not_replaced_for_ever(client, pool):
    with connected(client, new_visit(client)) as socket:
        started(socket)
        for crash in range(3):
            with pool.given:
                pool.workers[-1].die()
            until_phase(socket, "loading" if len(pool.workers) < MAX_CRASHES else "failed")
            assert pool.discarded[crash] is pool.workers[crash]


def test_workers_that_die_now_and_then_are_replaced_for_ever(client, pool):
    seen = {"time": 0.0, "busy": False, "body": [], "eye": [], "hands": [], "held": (None, None)}
    with connected(client, new_visit(client)) as socket:
        started(socket)
        for step in range(1, 3 * MAX_CRASHES):
            pool.workers[-1].say(Snapshot(step=step, input=0, **seen, objects={}, models={}, gone=[]))
            pool.workers[-1].say(Taken(0, step))
            pool.workers[-1].die()
            until_phase(socket, "ready")


def test_a_fork_server_that_was_just_killed_costs_no_session(monkeypatch):
    faults = iter([EOFError, ConnectionResetError])

    class Worker:
        def __init__(self):
            for fault in faults:
                raise fault

        async def connect(self):
            pass

    monkeypatch.setattr("experiments.web.server.pool.WorkerProcess", Worker)
    for name in (*SETTINGS, HOUSE):
        monkeypatch.setenv(name, "")  # is put back afterwards
    assert isinstance(asyncio.run(WorkerPool("apartment").start()), Worker)
    faults = iter(lambda: EOFError, None)
    monkeypatch.setattr("experiments.web.server.pool.END_TIMEOUT", 0.3)
    with pytest.raises(OSError, match="the fork server ended"):
        asyncio.run(WorkerPool("apartment").start())


def test_beyond_the_limit_participants_wait_in_a_queue(tmp_path, pool):
    with playing(tmp_path, pool, sessions=1) as client:
        links = [begin(client) for _ in range(3)]
        assert "data-trial" in client.get(links[0]).text
        with connected(client, links[0]) as first:
            started(first)
            assert "You are number 1 in the queue" in client.get(links[1]).text
            assert "You are number 2 in the queue" in client.get(links[2]).text
            left(first)
            until_phase(first, "ready")
            assert "You are number 1 in the queue" in client.get(links[1]).text, "the task follows"
            left(first)
        assert "data-trial" in client.get(links[1]).text
        play_trial(client, links[1], "training")


def test_a_page_names_the_scene_that_its_house_had_before(tmp_path, pool):
    with playing(tmp_path, pool) as client:
        link = new_visit(client)
        assert "/scene/" not in client.get(link).text
        with connected(client, link) as socket:
            started(socket)
            pool.workers[0].say(SCENE)
            until(socket, "scene")
        text = client.get(new_visit(client)).text
    assert 'data-scene="/scene/0123/"' in text and 'href="/scene/0123/house.glb" as="fetch"' in text


def test_an_idle_session_gives_its_place_back(tmp_path, pool, monkeypatch):
    monkeypatch.setattr("experiments.web.server.sessions.WATCH_PERIOD", 0.05)
    with playing(tmp_path, pool, "--idle", "1") as client, connected(client, new_visit(client)) as socket:
        started(socket)
        assert until(socket, "error")[-1]["code"] == "idle"
        with pytest.raises(WebSocketDisconnect) as closed:
            socket.receive_json()
        assert closed.value.code == protocol.IDLE
    assert pool.discarded


def test_a_closed_page_keeps_no_place_from_those_who_wait(tmp_path, monkeypatch, pool):
    monkeypatch.setattr("experiments.web.server.sessions.MAX_AWAY", 0.1)
    monkeypatch.setattr("experiments.web.server.sessions.WATCH_PERIOD", 0.05)
    with playing(tmp_path, pool, sessions=1) as client:
        link, other = new_visit(client), begin(client)
        with connected(client, link) as first:
            started(first)
        while "You are number 1 in the queue" in client.get(other).text:
            time.sleep(0.05)
        with connected(client, other) as second:
            started(second)
            with connected(client, link) as back:
                back.send_json(hello())
                until(back, "queue")
            assert "You are number 1 in the queue" in client.get(link).text


def test_a_damaged_visit_is_named_in_the_log_only(client, tmp_path, caplog):
    link = new_visit(client)
    (tmp_path / token_hash(link[6:]) / VISIT).write_text("{")
    answer = client.get(link)
    assert answer.status_code == 503 and str(tmp_path) not in answer.text
    assert "is damaged" in caplog.text


def test_frames_have_a_fixed_head():
    frame = FrameMessage(7, 8, 2**40, "h264", True, 640, 480, 12.5, b"picture")
    data = frame.packed()
    assert protocol.FRAME_HEAD.size == 28 and data[28:] == b"picture"
    assert protocol.FRAME_HEAD.unpack(data[:28]) == (1, 2, 1, 0, 640, 480, 7, 8, 2**40, 12.5)


def test_the_protocol_is_documented():
    text = (Path(__file__).parents[4] / "docs" / "protocol.md").read_text("utf-8")
    rows = dict(re.findall(r"^\| `(\w+)` \| ([^|]*)\|", text, re.MULTILINE))
    for kind in (*protocol.FromBrowser.__args__, *protocol.ToBrowser.__args__):
        fields = set(re.findall(r"`(\w+)`", rows[kind.__struct_config__.tag]))
        assert fields == set(kind.__struct_fields__)
    for code in (protocol.REFUSED, protocol.REPLACED, protocol.IDLE, protocol.TOO_MUCH, protocol.SLOW):
        assert str(code) in text
    assert set(re.findall(r"`([a-z ]+)` \(", text)) >= {"malformed", "too early", "out of order", "too much"}
