"""Nobody gets in: every route of both applications is tried by every role, from other sites, and with bad bodies."""

import contextlib
import io
import json
import logging
import re
import time

import pytest
from scripted_workers import hello
from starlette.routing import Mount, Route, WebSocketRoute
from study_site import PASSWORD, ROLES, phase_of, served
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from experiments.cli.server import JsonLines
from experiments.errors import StoreError
from experiments.study.data.collect import collect, write_collected
from experiments.visit.server.admission import NEW_PEOPLE
from experiments.visit.store import Store
from experiments.visit.tokens import token_hash
from experiments.web.client_files import static_url

PHASES = 'phases = ["consent", "task", "survey", "completion"]\n'
EVERYBODY = {"nobody", "participant", "other participant", *ROLES}
PARTICIPANT, NOBODY = {"participant"}, set()
ASSISTANTS, OWNER = {"assistant", "owner"}, {"owner"}
PICTURE, STATIC, SCENE = ("GET", "/house.webp"), ("GET", "/static"), ("GET", "/scene/{hash}/{name:path}")
# Who is let in. A new route needs a row here: decide who may do what it does.
PEOPLE = {
    ("GET", "/"): EVERYBODY,
    PICTURE: EVERYBODY,
    ("POST", "/begin"): EVERYBODY,
    ("GET", "/play/{token}"): PARTICIPANT,
    ("POST", "/play/{token}"): PARTICIPANT,
    ("POST", "/play/{token}/answers"): PARTICIPANT,
    ("GET", "/play/{token}/withdrawal"): PARTICIPANT,
    ("POST", "/play/{token}/withdrawal"): PARTICIPANT,
    ("GET", "/play/{token}/consent.txt"): PARTICIPANT,
    ("GET", "/play/{token}/film"): PARTICIPANT,
    ("GET", "/play/{token}/floor-plan.png"): NOBODY,  # a study has no page of the result
    ("GET", "/play/{token}/ping"): EVERYBODY,  # it does nothing; the time that it takes is measured
    ("WS", "/play/{token}"): PARTICIPANT,
    SCENE: EVERYBODY,
    STATIC: EVERYBODY,
}
RESEARCHERS = {
    ("GET", "/health"): EVERYBODY,
    ("GET", "/metrics"): EVERYBODY,
    ("GET", "/login"): EVERYBODY,
    ("POST", "/login"): NOBODY,  # without a password
    ("POST", "/logout"): set(ROLES),
    ("GET", "/"): set(ROLES),
    ("GET", "/people"): set(ROLES),
    ("GET", "/people/{number:int}"): set(ROLES),
    ("GET", "/people/{number:int}/watch"): set(ROLES),
    ("WS", "/people/{number:int}/watch"): set(ROLES),
    ("GET", "/audit"): ASSISTANTS,
    ("POST", "/pause"): ASSISTANTS,
    ("POST", "/continue"): ASSISTANTS,
    ("POST", "/stop"): OWNER,
    ("POST", "/reopen"): OWNER,
    ("POST", "/quota"): OWNER,
    SCENE: EVERYBODY,
    STATIC: EVERYBODY,
}
HOSTILE = "<script>alert(1)</script>'; DROP TABLE person; --\0{{ 7 * 7 }}"


def routes(app):
    """Method and path of every route."""
    for route in app.routes:
        if isinstance(route, WebSocketRoute):
            yield "WS", route.path
        elif isinstance(route, Mount):
            yield STATIC
        else:
            assert isinstance(route, Route) and route.methods is not None
            yield from ((method, route.path) for method in sorted(route.methods - {"HEAD"}))


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    with served(tmp_path_factory.mktemp("site"), PHASES, workers=1000) as site:
        yield site


def new_person(site):
    """Somebody whose task can be played: the token of their link."""
    new_person.count = getattr(new_person, "count", 0) + 1
    with site.client(headers={"X-Forwarded-For": f"192.0.2.{new_person.count % 200}"}) as client:
        link = site.begin(client)
        client.post(link, data={"phase": "consent", "agree": "yes"})
        assert phase_of(client, link) == "task"
    return link.rsplit("/", 1)[1]


@contextlib.contextmanager
def connected(url, path, origin, headers):
    address = url.replace("http", "ws", 1).rstrip("/") + path
    with connect(address, origin=origin, additional_headers=headers, close_timeout=1) as socket:
        yield socket


def cookies(client):
    return {"Cookie": "; ".join(f"{one.name}={one.value}" for one in client.cookies.jar)}


def let_in(app_url, method, path, client):
    """Whether a request gets past all checks of who asks."""
    if method == "WS":
        try:
            with connected(app_url, path, app_url.rstrip("/"), cookies(client)):
                return True
        except InvalidStatus:
            return False
    answer = client.request(method, app_url.rstrip("/") + path, headers={"Origin": app_url.rstrip("/")})
    assert answer.status_code < 500, (method, path, answer.text)
    sent_away = answer.headers.get("location") == "/login" and path != "/logout"
    return answer.status_code not in (401, 403, 404) and not (sent_away or _without_login(answer))


def _without_login(answer):
    """Whether somebody who is not logged in was to log out."""
    return answer.request.url.path == "/logout" and "set-cookie" not in answer.headers


def scene_file(site):
    """A file of a scene that there is; the picture of its house is there as well."""
    from experiments.web.worker.houses import house, make_files, scene_files

    shown = house(site.study.cells[0].trial(0).house)
    make_files(shown)
    path, _ = scene_files(shown)
    return f"{path}scene.json"


def browser(site, role):
    """What somebody of a role comes with."""
    return site.logged_in(role) if role in ROLES else site.client(researcher=True)


def test_every_route_has_a_row_that_says_who_is_let_in(site):
    assert set(routes(site.people)) == set(PEOPLE)
    assert set(routes(site.researchers)) == set(RESEARCHERS)


@pytest.mark.slow
def test_every_route_lets_in_who_may_and_nobody_else(site):
    wrong, browsers = [], {role: browser(site, role) for role in EVERYBODY}
    playing, files = new_person(site), {STATIC: static_url("style.css"), SCENE: scene_file(site)}
    with connected(site.url, f"/play/{playing}", site.url.rstrip("/"), {}) as socket:
        socket.send(json.dumps(hello("task")))
        socket.recv(timeout=20)
        number = site.ask(site.store.find(token_hash(playing))).id
        for app_url, table in ((site.url, PEOPLE), (site.researcher_url, RESEARCHERS)):
            for (method, path), allowed in table.items():
                for role in sorted(EVERYBODY):
                    # Others may know what is no secret: the name of the person's folder.
                    token = new_person(site) if role == "participant" else token_hash(playing)
                    there = path.replace("{token}", token).replace("{number:int}", str(number))
                    there = files.get((method, path), there)
                    came = let_in(app_url, method, there, browsers[role])
                    if path == "/logout":
                        browsers[role] = browser(site, role)
                    site.ask(site.store.set_state("open", "test"))
                    if came != (role in allowed):
                        wrong.append(f"{role} is {'' if came else 'not '}let in by {method} {app_url}{path}")
    assert wrong == []


@pytest.mark.slow
def test_no_other_site_can_use_the_cookie_or_the_link_of_somebody(site):
    with contextlib.closing(site.logged_in("owner")) as client:
        token = new_person(site)
        for app_url, table in ((site.url, PEOPLE), (site.researcher_url, RESEARCHERS)):
            other_port = (site.researcher_url if app_url == site.url else site.url).rstrip("/")
            for method, path in table:
                if method == "GET":
                    continue
                there = path.replace("{token}", token).replace("{number:int}", "1")
                for origin in (
                    "http://evil.example",
                    other_port,
                    "null",
                    app_url.rstrip("/") + ".evil.example",
                    None,
                ):
                    if method == "WS":
                        with pytest.raises(InvalidStatus), connected(app_url, there, origin, cookies(client)):
                            pass
                        continue
                    headers = {} if origin is None else {"Origin": origin}
                    request = client.build_request(method, app_url.rstrip("/") + there, headers=headers)
                    if origin is None:
                        del request.headers["Origin"]
                    assert client.send(request).status_code == 403, (method, path, origin)
        assert "open" in client.get("/").text


def bodies():
    """Bodies that are no forms, or too much of one: their headers and content."""
    yield (
        {"Content-Type": "multipart/form-data; boundary=x"},
        b'--x\r\nContent-Disposition: form-data; name="a"; filename="../../a.php"\r\n\r\n\0\r\n--x--',
    )
    yield {"Content-Type": "application/json"}, b'{"phase": "task", "wanted": 1e999}'
    yield {"Content-Type": "text/plain"}, b"\xff\xfe\0" * 100
    yield {"Content-Type": "application/x-www-form-urlencoded"}, b"&".join(b"f%d=1" % k for k in range(700))
    yield (
        {"Content-Type": "application/x-www-form-urlencoded"},
        b"phase=%00&name=%00&password=%00&cell=%ff&wanted=%00&data=%00",
    )
    yield {"Content-Type": "application/x-www-form-urlencoded"}, b"phase=task&" + b"x" * 1_000_000
    yield {"Content-Type": "image/png"}, b"\x89PNG\r\n\x1a\n" + bytes(1000)


@pytest.mark.slow
def test_nothing_that_is_uploaded_breaks_anything_or_stays(site, caplog):
    with contextlib.closing(site.logged_in("owner")) as client:
        token, number = new_person(site), site.ask(site.store.study())
        for app_url, table in ((site.url, PEOPLE), (site.researcher_url, RESEARCHERS)):
            for method, path in table:
                if method != "POST" or path in ("/logout", "/pause", "/continue", "/stop", "/reopen"):
                    continue  # those that need no body
                there = app_url.rstrip("/") + path.replace("{token}", token)
                for headers, body in bodies():
                    headers = {**headers, "Origin": app_url.rstrip("/"), "X-Forwarded-For": "192.0.2.250"}
                    answer = client.post(there, headers=headers, content=body)
                    assert answer.status_code < 500, (path, headers)
                    assert len(body) < 100_000 or answer.status_code == 413
                    chunked = client.post(there, headers=headers, content=iter([body]))
                    assert chunked.status_code == 413, "a body of unknown length"
                for other in ("PUT", "DELETE", "PATCH", "TRACE"):
                    answer = client.request(other, there, headers={"Origin": app_url.rstrip("/")})
                    assert answer.status_code in (404, 405)
        assert site.ask(site.store.study()) == number
        assert client.get("/health").status_code == 200
    assert [record.getMessage() for record in caplog.records if record.levelno >= logging.ERROR] == []


@pytest.mark.slow
def test_what_people_write_is_kept_as_it_is_and_harms_nothing(tmp_path):
    words = {
        HOSTILE,
        '=HYPERLINK("http://evil.example")',
        "@SUM(1+1)",
        "\t=1+1",
        "%n%s%00",
        "\ud7ff\U0001f600",
    }
    with served(
        tmp_path,
        'phases = ["consent", "survey", "task", "completion"]\n'.replace(
            '"survey", "task"', '"task", "survey"'
        ),
    ) as site:
        for number, text in enumerate(sorted(words), 1):
            with site.client() as client:
                link = site.begin(client)
                client.post(link, data={"phase": "consent", "agree": "yes"})
                client.get(link)
                site.ask(site.store.finish_phase(number, "task", "survey"))
                sent = client.post(f"{link}/answers", data={"phase": "survey", "comments": text})
                assert sent.status_code == 204
                assert "<script>alert" not in client.get(link).text
                scales = {item.name: "3" for item in site.study.texts["survey"].items if item.kind == "scale"}
                assert (
                    client.post(link, data={"phase": "survey", "comments": text, **scales}).status_code == 303
                )
        kept = {row.value for row in site.ask(site.store.answers()) if row.item == "comments"}
        assert {text.strip() for text in kept} == {text.strip() for text in words}
        with contextlib.closing(site.logged_in("owner")) as client:
            for path in ("/", "/people", "/people/1", "/audit"):
                assert (
                    "evil.example" not in client.get(path).text
                    and "<script>alert" not in client.get(path).text
                )
        write_collected(site.ask(collect(site.study, site.store, tmp_path)), tmp_path / "table")
    cells = (tmp_path / "table" / "texts.csv").read_text().splitlines()[1:]
    assert not [line for line in cells if re.search(r'(^|,)"?[=+\-@\t\r]', line)]


def test_nobody_makes_people_without_end(site):
    with site.client(headers={"X-Forwarded-For": "203.0.113.1"}) as client:
        begun = [client.post("/begin").status_code for _ in range(int(NEW_PEOPLE[0]) + 1)]
        assert set(begun[:-1]) == {303} and begun[-1] == 429
        busy = client.post("/begin")
        assert "wait a minute and try again" in busy.text and 'action="/begin"' in busy.text
        assert "paused" not in busy.text and busy.headers["retry-after"] == "60"
    with site.client(headers={"X-Forwarded-For": "203.0.113.2"}) as client:
        assert client.post("/begin").status_code == 303


def test_a_link_opens_few_sockets(site):
    link, origin = f"/play/{new_person(site)}", site.url.rstrip("/")
    with connected(site.url, link, origin, {}), connected(site.url, link, origin, {}):
        with pytest.raises(InvalidStatus), connected(site.url, link, origin, {}):
            pass
        with connected(site.url, f"/play/{new_person(site)}", origin, {}):
            pass
    for _ in range(100):  # a socket counts until the server has noticed that it was closed
        with contextlib.suppress(InvalidStatus), connected(site.url, link, origin, {}):
            return
        time.sleep(0.1)
    pytest.fail("the link opens no socket any more")


SECRETS = {
    "PROLIFIC_PID": "5ecretperson000000000001",
    "STUDY_ID": "5ecretstudy0000000000001",
    "SESSION_ID": "5ecretsubmission00000001",
}
ADDRESS, WRITTEN = "203.0.113.77", "5ecret words of mine"
PROLIFIC = """
[study.recruitment]
platform = "prolific"
completed = "C0MPLETE"
screened_out = "C0UT"
no_consent = "C0NO"
"""


def test_who_knows_the_platforms_id_of_somebody_does_not_get_their_visit(tmp_path):
    """At every route that takes ids, in every way but with the submission's id or the link itself."""
    with served(tmp_path, PHASES + PROLIFIC) as site, site.client() as client:
        link = site.begin(client, **SECRETS)
        token = link.rsplit("/", 1)[1]
        assert client.get("/", params=SECRETS).headers["location"] == link
        other = {**SECRETS, "SESSION_ID": "5ecretsubmission00002"}
        takes_ids = [(method, path) for method, path in PEOPLE if path in ("/", "/begin")]
        assert len(takes_ids) == 2
        for method, path in takes_ids:
            for wrong in ({}, {"token": "x" * 43}, {"token": token_hash(token)}, {"token": "é"}):
                ids = {"params" if method == "GET" else "data": {**other, **wrong}}
                answer = client.request(method, path, **ids)
                assert answer.status_code == 403 and "location" not in answer.headers
                assert token not in answer.text and "Did you start in another browser?" in answer.text
        assert site.begin(client, **other, token=token) == link


@pytest.fixture
def log():
    """What a server writes to its log, as JSON."""
    text = io.StringIO()
    handler = logging.StreamHandler(text)
    handler.setFormatter(JsonLines())
    logging.getLogger().addHandler(handler)
    loggers = [logging.getLogger(name) for name in ("mjsim.play", "mjsim.study")]
    before = [one.level for one in loggers]
    for one in loggers:
        one.setLevel(logging.INFO)
    yield text
    logging.getLogger().removeHandler(handler)
    for one, level in zip(loggers, before, strict=True):
        one.setLevel(level)


def test_no_log_metric_or_page_tells_who_somebody_is(tmp_path, log, monkeypatch):
    """A whole visit with faults in it, full of marked secrets; then every place is searched for them."""
    with served(tmp_path, PHASES + PROLIFIC) as site:
        client = site.client(headers={"X-Forwarded-For": ADDRESS})
        client.get("/", params={**SECRETS, "PROLIFIC_PID": "5ecret!"})
        client.get("/", params=SECRETS)
        link = site.begin(client, **SECRETS)
        token = link.rsplit("/", 1)[1]

        async def broken(*_, **__):
            raise StoreError("the disk is full")

        async def unforeseen(*_, **__):
            raise ValueError(WRITTEN)

        for fault in (broken, unforeseen):
            with monkeypatch.context() as patched:
                patched.setattr(Store, "finish_phase", fault)
                assert client.post(link, data={"phase": "consent", "agree": "yes"}).status_code >= 500
        client.post(link, data={"phase": "consent", "agree": "yes"})
        assert phase_of(client, link) == "task"
        with connected(site.url, link, site.url.rstrip("/"), {"X-Forwarded-For": ADDRESS}) as socket:
            socket.send("5ecret words of mine")
            socket.send(json.dumps(hello("task")))
            for wanted in ("ready", "running"):
                while json.loads(socket.recv(timeout=20)).get("phase") != wanted:
                    pass
                socket.send('{"type": "run", "until": null}')
                if wanted == "ready":
                    pages = researchers_pages(site)
            site.pool.workers[0].die()
            while json.loads(socket.recv(timeout=20)).get("phase") != "ready":
                pass
            socket.send('{"type": "run", "until": null}')
            socket.send('{"type": "inputs", "inputs": [{"number": 1, "scroll": 100}]}')
            while json.loads(socket.recv(timeout=20))["type"] != "saved":
                pass
        scales = {item.name: "3" for item in site.study.texts["survey"].items if item.kind == "scale"}
        answered = client.post(link, data={"phase": "survey", "comments": WRITTEN, **scales})
        assert answered.status_code == 303 and "C0MPLETE" in client.get(link).text
        pages += researchers_pages(site)
    lines = [json.loads(line) for line in log.getvalue().splitlines()]
    assert {"person 1 arrives"} < {line["message"] for line in lines}
    assert [line["error"] for line in lines if "error" in line] == ["ValueError"]
    assert "p00001" in pages and 'mjsim_people{status="finished"} 1.0' in pages
    for secret in (*SECRETS.values(), "5ecret", ADDRESS, WRITTEN, token, PASSWORD):
        assert secret not in log.getvalue(), secret
        assert secret not in pages, secret


def researchers_pages(site):
    """All that the researcher's port says, one after the other."""
    with contextlib.closing(site.logged_in("owner")) as client:
        paths = ("/", "/people", "/people/1", "/people/1/watch", "/audit", "/metrics", "/health", "/nothing")
        return "".join(client.get(path).text for path in paths)
