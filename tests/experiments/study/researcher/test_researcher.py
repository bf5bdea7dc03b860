"""The researcher's page over real HTTP: logins, roles, what it shows and changes, watching, health and metrics."""

import io
import json
import re
import subprocess
import sys

import httpx
import pytest
from prometheus_client.parser import text_string_to_metric_families
from scripted_workers import hello
from starlette.responses import Response
from study_site import CELLS, PASSWORD, served
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from experiments.cli.main import main
from experiments.errors import StoreError
from experiments.study.researcher.access import ATTEMPTS, COOKIE, Access
from experiments.visit.tokens import token_hash
from experiments.web.state import Snapshot

PHASES = 'phases = ["consent", "task", "survey", "completion"]\n'


@pytest.fixture
def site(tmp_path):
    with served(tmp_path, PHASES) as site:
        yield site


def playing(site, client):
    """Begin, consent, and connect the page of the task; the link and its socket."""
    link = site.begin(client)
    assert client.post(link, data={"phase": "consent", "agree": "yes"}).status_code == 303
    assert client.get(link).status_code == 200
    return link, socket_of(site.url, link)


def socket_of(url, path, **headers):
    address = url.replace("http", "ws", 1).rstrip("/") + path
    return connect(address, origin=url.rstrip("/"), additional_headers=headers, close_timeout=1)


def cookie(client):
    return {"Cookie": f"{COOKIE}={client.cookies[COOKIE]}"}


def until(socket, kind):
    while (message := json.loads(socket.recv(timeout=20)))["type"] != kind:
        pass
    return message


def test_who_is_logged_in_sees_the_study_and_who_is_not_sees_the_login(site):
    nobody, owner = site.client(researcher=True), site.logged_in("owner")
    for path in ("/", "/people", "/people/1", "/people/1/watch", "/audit"):
        answer = nobody.get(path)
        assert (answer.status_code, answer.headers["location"]) == (303, "/login")
    link = site.begin(site.client())
    text = owner.get("/").text
    assert "The study is open." in text and "optimal, 1 object<" in text
    assert "p00001" in owner.get("/people").text and "consent" in owner.get("/people/1").text
    for path in ("/people/2", "/people/99999999999999999999", "/people/x", "/nothing"):
        assert owner.get(path).status_code == 404
    assert link.rsplit("/", 1)[1] not in text


def test_participants_are_listed_a_page_at_a_time_and_found_by_name_status_or_phase(site, monkeypatch):
    monkeypatch.setattr("experiments.study.researcher.app.PAGE_SIZE", 2)
    owner = site.logged_in("owner")
    assert "No participants yet" in owner.get("/people").text
    for _ in range(5):
        site.begin(site.client())
    site.ask(site.store.withdraw(4, delete=False))

    def listed(**asked):
        text = owner.get("/people", params=asked).text
        links = re.findall(r'href="/people\?([^"]*)">(\w+) page', text)
        return re.findall(r"p0000\d(?=</a></th>)", text), [(name, link) for link, name in links]

    assert listed() == (["p00001", "p00002"], [("Next", "find=&amp;page=2")])
    assert listed(page=2)[0] == ["p00003", "p00004"]
    assert [name for name, _ in listed(page=2)[1]] == ["Previous", "Next"]
    last = (["p00005"], [("Previous", "find=&amp;page=2")])
    assert listed(page=3) == listed(page=999) == last
    for other in ("0", "-1", "x", "\0", "9" * 5000, "\u0663"):
        assert listed(page=other) == listed()
    assert listed(find="P00003")[0] == ["p00003"] and listed(find="withdrawn")[0] == ["p00004"]
    assert listed(find="consent", page=2)[1][0] == ("Previous", "find=consent&amp;page=1")
    text = owner.get("/people", params={"find": '"><b>'}).text
    assert "No participant matches" in text and "<b>" not in text


def test_wrong_passwords_and_names_are_told_the_same_and_are_limited(site):
    client = site.client(researcher=True)
    tried = [("owner", "wrong"), ("nobody", PASSWORD), ("x\0'; DROP TABLE login; --", "\0"), ("", "")]
    texts = set()
    for name, password in tried:
        answer = client.post("/login", data={"name": name, "password": password})
        texts.add((answer.status_code, answer.text))
        assert "set-cookie" not in answer.headers
    assert len(texts) == 1 and texts.pop()[0] == 403
    for _ in range(ATTEMPTS[0] - 1):
        client.post("/login", data={"name": "owner", "password": "wrong"})
    right = {"name": "owner", "password": PASSWORD}
    assert client.post("/login", data=right).status_code == 429
    elsewhere = site.client(researcher=True, headers={"X-Forwarded-For": "192.0.2.9"})
    assert elsewhere.post("/login", data=right).status_code == 303


def test_nobody_locks_the_account_of_another_researcher(site):
    stranger = site.client(researcher=True)
    tried = [("owner", "wrong"), ("my password", PASSWORD)]
    for name, password in tried:
        assert stranger.post("/login", data={"name": name, "password": password}).status_code == 403
    for number in range(ATTEMPTS[0] + 1):
        elsewhere = site.client(researcher=True, headers={"X-Forwarded-For": f"192.0.2.{number + 1}"})
        assert elsewhere.post("/login", data={"name": "owner", "password": "wrong"}).status_code == 403
    assert site.logged_in("owner").get("/").status_code == 200
    assert (
        site.client(researcher=True).post("/login", data={"name": "viewer", "password": PASSWORD}).status_code
        == 303
    )
    failed = [row.who for row in site.ask(site.store.audit_log()) if row.action == "login failed"]
    assert failed == ["owner", "unknown", *["owner"] * (ATTEMPTS[0] + 1)]


def test_a_login_has_a_new_secret_and_ends_when_it_should(site):
    client = site.client(researcher=True)
    planted = "a" * 43
    client.cookies.set(COOKIE, planted, domain="127.0.0.1")
    answer = client.post("/login", data={"name": "owner", "password": PASSWORD})
    first = re.search(rf"{COOKIE}=([\w-]{{43}});", answer.headers["set-cookie"])[1]
    assert first != planted
    for word in ("HttpOnly", "SameSite=strict", "Path=/"):
        assert word in answer.headers["set-cookie"]

    def may(token):
        return httpx.get(site.researcher_url, headers={"Cookie": f"{COOKIE}={token}"}).status_code == 200

    assert may(first) and not may(planted) and not may(token_hash(first))
    with site.client(researcher=True, headers={"Cookie": f"{COOKIE}={first}"}) as again:
        again.post("/login", data={"name": "owner", "password": PASSWORD})
    assert not may(first), "a new login ends the one before in the same browser"
    one, other = site.logged_in("owner"), site.logged_in("owner")
    assert one.post("/logout", data={"where": "everywhere"}).headers["location"] == "/login"
    assert not may(one.cookies.get(COOKIE, "")) and other.get("/").status_code == 303
    third = site.logged_in("owner")
    site.ask(site.store.researchers.change("owner", role="viewer"))
    assert third.get("/").status_code == 303


def test_over_https_the_cookie_stays_with_the_host():
    response = Response()
    Access(None, secure=True).remember(response, "x" * 43)
    assert (
        response.headers["set-cookie"].startswith(f"__Host-{COOKIE}=")
        and "Secure" in response.headers["set-cookie"]
    )


def test_pausing_stopping_and_quotas_hold_for_people_and_are_logged(site):
    owner, assistant = site.logged_in("owner"), site.logged_in("assistant")
    assert assistant.post("/pause").status_code == 303
    assert "paused" in site.client().get("/").text
    assert assistant.post("/pause").status_code == 409
    assert assistant.post("/continue").status_code == 303
    assert owner.post("/stop").status_code == 303
    assert "Enough people have already taken part" in site.client().get("/").text
    assert assistant.post("/continue").status_code == 409
    assert owner.post("/reopen").status_code == 303
    for cell, wanted in (("0", "-1"), ("7", "3"), ("0", "x"), ("", ""), ("0", "²"), ("0", "9999999999")):
        assert owner.post("/quota", data={"cell": cell, "wanted": wanted}).status_code == 400
    client = site.client()
    link = site.begin(client)
    assert owner.post("/quota", data={"cell": "0", "wanted": "0"}).status_code == 303
    client.post(link, data={"phase": "consent", "agree": "yes"})
    assert "All places are taken" in client.get(link).text
    text = assistant.get("/audit").text
    for words in ("study paused", "study open", "study closed", "quota changed", "wanted: 0", "logged in"):
        assert words in text


def test_a_session_is_watched_live_by_who_can_send_nothing(site):
    viewer = site.logged_in("viewer")
    with site.client() as client:
        _, page = playing(site, client)
        with page:
            page.send(json.dumps(hello("task")))
            until(page, "state")
            path = "/people/1/watch"
            assert "/people/1/watch" in viewer.get("/people").text
            assert viewer.get(path).status_code == 200
            with pytest.raises(InvalidStatus):
                socket_of(site.researcher_url, path)
            with socket_of(site.researcher_url, path, **cookie(viewer)) as watching:
                assert until(watching, "state")["phase"] in ("loading", "ready")
                page.send('{"type": "run", "until": null}')
                while until(watching, "state")["phase"] != "running":
                    pass
                seen = {"time": 0.0, "busy": False, "body": [], "eye": [], "hands": [], "held": (None, None)}
                site.pool.workers[0].say(Snapshot(step=3, input=0, **seen, objects={}, models={}, gone=[]))
                assert until(watching, "snapshot")["step"] == until(page, "snapshot")["step"] == 3
                told = len(site.pool.workers[0].told)
                watching.send('{"type": "leave"}')
                with pytest.raises(ConnectionClosed):
                    until(watching, "nothing")
                assert len(site.pool.workers[0].told) == told
    assert [row.details for row in site.ask(site.store.audit_log()) if row.action == "watches"] == [
        {"person": 1}
    ]


def test_who_is_logged_out_watches_no_longer(site, monkeypatch):
    monkeypatch.setattr("experiments.study.researcher.app.CHECK_PERIOD", 0.2)
    viewer = site.logged_in("viewer")
    with site.client() as client:
        _, page = playing(site, client)
        with page:
            page.send(json.dumps(hello("task")))
            until(page, "state")
            with socket_of(site.researcher_url, "/people/1/watch", **cookie(viewer)) as watching:
                until(watching, "state")
                viewer.post("/logout")
                with pytest.raises(ConnectionClosed):
                    until(watching, "nothing")


def test_health_and_metrics_need_no_login_and_tell_numbers(site, monkeypatch):
    with site.client() as client:
        _, page = playing(site, client)
        with page:
            page.send(json.dumps(hello("task")))
            while until(page, "state")["phase"] != "ready":
                pass
            page.send('{"type": "run", "until": null}')
            while until(page, "state")["phase"] != "running":
                pass
            page.send('{"type": "inputs", "inputs": [{"number": 1, "scroll": 1}]}')
            until(page, "taken")
            site.pool.workers[0].die()
            while until(page, "state")["phase"] != "ready":
                pass
            answer = site.client(researcher=True).get("/metrics")
    found = {
        (sample.name, *sample.labels.values()): sample.value
        for family in text_string_to_metric_families(answer.text)
        for sample in family.samples
    }
    assert found["mjsim_people", "assigned"] == found["mjsim_workers_lost_total",] == 1
    assert found["mjsim_sessions", "ready"] == found["mjsim_input_acknowledged_seconds_count",] == 1
    assert found["mjsim_database_write_seconds_count",] > 3
    assert found["mjsim_http_answer_seconds_count", "3xx"] == 2
    assert found["mjsim_sessions_capacity",] == 20 and found["mjsim_sessions_waiting",] == 0
    sessions = {"capacity": 20, "in_use": 1, "waiting": 0}
    health = site.client(researcher=True).get("/health").json()
    assert health == {"database": "up", "study": "open", "sessions": sessions}

    async def fail(_):
        raise StoreError("gone")

    monkeypatch.setattr(type(site.store), "study", fail)
    down = site.client(researcher=True).get("/health")
    assert (down.status_code, down.json()) == (503, {"database": "down"})


def test_payments_frames_and_dropouts_are_counted(site):
    owner = site.logged_in("owner")
    client = site.client()
    leaves = site.begin(client)
    client.post(leaves, data={"phase": "consent", "agree": "no"})
    site.ask(site.store.ledger.decide(1, "screen_out", 150, "USD", "p00001-screen_out"))
    text = owner.get("/").text
    assert re.search(r"screen out</th><td>1</td><td>1.50 USD</td><td>0</td>", text)
    assert re.search(r"consent</th><td>0</td><td>0</td><td>1</td>", text)
    site.ask(_paid(site.store))
    assert re.search(
        r"screen out</th><td>1</td><td>1.50 USD</td><td>1</td><td>1.50 USD</td>", owner.get("/").text
    )


async def _paid(store):
    attempt = await store.ledger.begin_sending("p00001-screen_out")
    await store.ledger.confirm("p00001-screen_out", attempt, "a receipt")


def test_researchers_are_made_on_the_command_line_and_passwords_never_stand_on_it(
    tmp_path, capsys, monkeypatch
):
    (tmp_path / "study.toml").write_text(CELLS)
    names = [str(tmp_path / "study.toml"), str(tmp_path / "out")]

    def command(what, *words, given=""):
        monkeypatch.setattr("sys.stdin", io.StringIO(given))
        return main(["study", "researcher", what, *names, *words])

    assert command("add", "ada", "--role", "owner", given="short\n") == 2
    assert command("add", "ada", "--role", "owner", given=f"{PASSWORD}\n") == 0
    assert command("add", "ada", "--role", "owner", given=f"{PASSWORD}\n") == 2
    assert command("add", "Bob Bobson", "--role", "owner", "--generate") == 2
    assert command("add", "bob", given=PASSWORD) == 2
    assert command("change", "ada", "--role", "viewer", "--keep-password") == 0
    assert command("disable", "ada") == 0
    capsys.readouterr()
    assert command("list") == 0
    assert capsys.readouterr().out == "ada  viewer  disabled\n"
    assert command("add", "eve", "--role", "assistant", "--generate") == 0
    assert len(capsys.readouterr().out.split("\n")[0]) == 24
    monkeypatch.setattr("sys.stdin", None)
    assert main(["study", "researcher", "add", *names, "ivy", "--role", "viewer"]) == 2
    assert "standard input is closed" in capsys.readouterr().err
    names[1] = str(tmp_path / "another")  # a misspelt folder is not created
    assert command("list") == 2
    assert not (tmp_path / "another").exists()


@pytest.mark.slow
def test_a_served_study_has_both_ports_logs_json_and_ends_as_a_whole(tmp_path):
    (tmp_path / "study.toml").write_text(CELLS + PHASES)
    words = ["study", "serve", "study.toml", "--out", "out", "--port", "0", "--researcher-port", "0"]
    process = subprocess.Popen(
        [sys.executable, "-m", "mjsim", *words, "--no-open", "--log-json"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    url, researcher_url = (process.stdout.readline().strip() for _ in range(2))
    assert httpx.post(f"{url}begin", headers={"Origin": url.rstrip("/")}, timeout=200).status_code == 303
    health = httpx.get(f"{researcher_url}health", timeout=60).json()
    assert health["database"] == "up" and health["sessions"]["capacity"] >= 1
    assert 'mjsim_people{status="arrived"} 1.0' in httpx.get(f"{researcher_url}metrics", timeout=60).text
    process.terminate()
    _, log = process.communicate(timeout=60)
    assert json.loads(log.splitlines()[0])["message"] == "person 1 arrives"
    for address in (url, researcher_url):
        with pytest.raises(httpx.ConnectError):
            httpx.get(address)
