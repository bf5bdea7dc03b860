"""A study served to people: pages in order, nothing lost, repeated or skipped; trials by a scripted worker."""

import dataclasses
import hashlib
import re
import sqlite3
import threading
import time
from contextlib import closing, contextmanager

import msgspec
import numpy as np
import pytest
from scripted_workers import ORIGIN, ScriptedPool, connected, play_trial, started, until
from starlette.testclient import TestClient
from study_database import new_database
from study_site import MadeInItsLoop

from experiments.errors import StoreError
from experiments.study.file import read_people_study
from experiments.study.plan import plan_of
from experiments.trials.designs import FOLDER
from experiments.visit.folders import VisitFolders
from experiments.visit.procedure import Procedure
from experiments.visit.server.app import ServerOptions, VisitServer
from experiments.visit.store import Store

DEVICE = {"frames_per_s": "60", "latency_ms": "40", "width": "1280", "height": "720", "pixel_ratio": "1"}
DEVICE |= {"keyboard": "yes", "webgl": "yes", "renderer": "a card"}


@pytest.fixture(scope="module")
def study():
    study = read_people_study(FOLDER / "paper.toml")
    return dataclasses.replace(study, settings=msgspec.structs.replace(study.settings, minimum={}))


@contextmanager
def serving(folder, study):
    url = new_database(folder / "study.db")
    with serving_from(url, folder, study) as client:
        yield client


@contextmanager
def serving_from(url, folder, study):
    film = folder / "film.mp4"
    film.write_bytes(b"a film")

    async def make():
        store = await Store.open(url, "study", "0" * 64)
        folders, rng = VisitFolders(folder / "visits"), np.random.default_rng(0)
        procedure = Procedure(plan_of(study, film), store, folders, rng)
        return VisitServer(procedure, ScriptedPool(), ServerOptions(b"secret", workers=20)).app("127.0.0.1")

    with TestClient(MadeInItsLoop(make), base_url=ORIGIN, follow_redirects=False) as client:
        yield client


@pytest.fixture
def client(tmp_path, study):
    with serving(tmp_path, study) as client:
        yield client


def post(client, path, **data):
    return client.post(path, data=data, headers={"Origin": ORIGIN})


def begin(client, **ids):
    answer = post(client, "/begin", **ids)
    assert answer.status_code == 303
    return answer.headers["location"]


def phase(client, link):
    """Name of the phase whose page is shown; None where there is none."""
    found = re.search(r'name="phase" value="(\w+)"|data-trial="(\w+)"', client.get(link).text)
    return next(name for name in found.groups() if name) if found else None


def right_answers(study):
    return {item.name: item.right for item in study.texts["comprehension"].items}


def survey_answers(study):
    return {item.name: "4" for item in study.texts["survey"].items if item.kind == "scale"}


def go_to(client, link, study, wanted):
    """Go through the phases until the wanted one is shown."""
    sent = {
        "consent": {"agree": "yes"},
        "device": DEVICE,
        "story": {},
        "flythrough": {},
        "comprehension": right_answers(study),
        "survey": survey_answers(study),
        "debriefing": {},
    }
    while (now := phase(client, link)) != wanted:
        assert now is not None, f"the study ended before {wanted}"
        if now in sent:
            assert post(client, link, phase=now, **sent[now]).status_code == 303
        else:
            play_trial(client, link, now)


def test_a_person_goes_through_all_phases_in_order(client, study):
    assert "7.50 USD" in client.get("/").text
    link, seen = begin(client), []
    for name in study.settings.phases[:-1]:
        go_to(client, link, study, name)
        seen.append(phase(client, link))
    assert seen == list(study.settings.phases[:-1])
    go_to(client, link, study, None)
    assert "Thank you" in client.get(link).text
    assert client.get(link).text == client.get(link).text  # it stays


def test_reload_back_and_double_submit_change_nothing(client, study):
    link = begin(client)
    go_to(client, link, study, "story")
    assert phase(client, link) == phase(client, link) == "story"
    for _ in range(2):  # a double click, and the form of a page before
        assert post(client, link, phase="story").status_code == 303
    assert post(client, link, phase="consent", agree="no").status_code == 303
    assert phase(client, link) == "flythrough"


def test_who_does_not_agree_leaves_and_cannot_come_back(client):
    link = begin(client)
    post(client, link, phase="consent", agree="no")
    assert "You did not agree" in client.get(link).text
    post(client, link, phase="consent", agree="yes")
    assert phase(client, link) is None


def test_three_wrong_comprehension_checks_end_the_study(client, study):
    link = begin(client)
    go_to(client, link, study, "comprehension")
    wrong = {**right_answers(study), "hands": "One"}
    assert "Attempts left: 3." in client.get(link).text
    for left in (2, 1):
        text = send_shown(client, link, **wrong)
        assert "Some answers are wrong" in text and f"Attempts left: {left}." in text
        assert "You then receive no payment." in text
    send_shown(client, link, **wrong)
    assert phase(client, link) is None
    assert "the study ends here" in client.get(link).text


def send_shown(client, link, **answers):
    """Send the form that is shown with answers, and return the page that follows."""
    hidden = dict(re.findall(r'type="hidden" name="(\w+)" value="([^"]*)"', client.get(link).text))
    answer = post(client, link, **{**hidden, **answers})
    assert answer.status_code == 303, "a reload of the page that follows must not send the form again"
    return client.get(answer.headers["location"]).text


def test_the_welcome_page_warns_of_the_check_of_the_computer_if_there_is_one(tmp_path, study):
    needed = plan_of(study, None).device
    for phases in (study.settings.phases, tuple(name for name in study.settings.phases if name != "device")):
        folder = tmp_path / f"{len(phases)}"
        folder.mkdir()
        changed = dataclasses.replace(study, settings=msgspec.structs.replace(study.settings, phases=phases))
        with serving(folder, changed) as client:
            page = client.get("/").text
            assert ("suitable.js" in page) is ("device" in phases)
            assert (f'id="unsuitable" data-width="{needed.width}"' in page) is ("device" in phases)
            assert "data-forgets" not in page


def test_a_computer_that_does_not_fit_may_be_given_up(client, study):
    link = begin(client)
    go_to(client, link, study, "device")
    assert 'name="give_up"' not in client.get(link).text
    assert "too slow" in send_shown(client, link, **{**DEVICE, "latency_ms": "9999"})
    assert 'name="give_up"' in client.get(link).text
    send_shown(client, link, **{**DEVICE, "latency_ms": "9999", "give_up": "yes"})
    assert phase(client, link) is None


@pytest.mark.parametrize("left_out", [(), ("hands",), ("hands", "speed")])
def test_missing_answers_and_repeated_clicks_use_up_no_attempt(client, study, left_out):
    link = begin(client)
    go_to(client, link, study, "comprehension")
    incomplete = {name: right for name, right in right_answers(study).items() if name not in left_out}
    for _ in range(5 * bool(left_out)):
        assert "missing or invalid" in send_shown(client, link, **incomplete)
    wrong = {**right_answers(study), "hands": "One", "phase": "comprehension", "attempt": "0"}
    for _ in range(5):  # a double click, Back and reload
        assert post(client, link, **wrong).status_code == 303
    assert "Attempts left: 2." in client.get(link).text
    assert "Some answers are wrong" not in client.get(link).text, "a note is shown once"
    for _ in range(2):
        post(client, link, **{**wrong, "hands": "As many as I like"})
        assert "Attempts left: 1." in client.get(link).text, (
            "a page that was used does not give further attempts"
        )
    post(client, link, **{**wrong, "hands": "Two"})
    assert phase(client, link) == "training"


def test_other_answers_on_an_old_page_count_after_a_restart(tmp_path, study):
    url = new_database(tmp_path / "study.db")
    wrong = {**right_answers(study), "hands": "One", "phase": "comprehension", "attempt": "0"}
    with serving_from(url, tmp_path, study) as client:
        link = begin(client)
        go_to(client, link, study, "comprehension")
        post(client, link, **wrong)
    with serving_from(url, tmp_path, study) as client:
        for answer, left in (("One", 2), ("As many as I like", 1)):
            post(client, link, **{**wrong, "hands": answer})
            assert f"Attempts left: {left}." in client.get(link).text


def test_the_agreement_is_kept_with_version_and_hash_of_the_text(client, study, tmp_path):
    link = begin(client)
    assert f'href="{link}/consent.txt"' in client.get(link).text
    copy = client.get(f"{link}/consent.txt")
    assert copy.headers["content-disposition"] == 'attachment; filename="consent.txt"'
    assert all(part in copy.text for part in study.texts["consent"].paragraphs())
    assert study.texts["consent"]["agree"] in copy.text
    post(client, link, phase="consent", agree="yes")
    with closing(sqlite3.connect(tmp_path / "study.db")) as database:
        found = dict(database.execute("SELECT item, value FROM answer WHERE phase = 'consent'"))
    digest = hashlib.sha256(copy.content).hexdigest()
    assert found == {"agreed": "true", "text_version": '"1"', "text_sha256": f'"{digest}"'}


@pytest.mark.parametrize(
    ("sent", "follows", "kept"),
    [
        ({"played_s": "40", "film_s": "88"}, "flythrough", {}),
        ({}, "flythrough", {}),
        ({"played_s": "nan", "film_s": "-1"}, "flythrough", {}),
        ({"played_s": "87.5", "film_s": "88"}, "comprehension", {"played_s": "87.5", "film_s": "88.0"}),
        ({"played_s": "0", "film_error": "4"}, "comprehension", {"played_s": "0.0", "film_error": "4.0"}),
    ],
)
def test_a_film_that_is_required_is_played(tmp_path, study, sent, follows, kept):
    settings = msgspec.structs.replace(study.settings, require_film=True)
    with serving(tmp_path, dataclasses.replace(study, settings=settings)) as client:
        link = begin(client)
        go_to(client, link, study, "flythrough")
        assert "Press the play button" in client.get(link).text
        text = send_shown(client, link, **{"played_s": "", "film_s": "", "film_error": "", **sent})
        assert phase(client, link) == follows
        assert (
            "Please press the play button" in text.replace(study.texts["flythrough"]["required"], "")
        ) is (follows == "flythrough")
    with closing(sqlite3.connect(tmp_path / "study.db")) as database:
        played = dict(database.execute("SELECT item, value FROM answer WHERE phase = 'flythrough' AND final"))
    assert played == kept


def test_the_welcome_page_waits_for_the_picture_of_the_house(tmp_path, study, monkeypatch):
    picture, unfinished = tmp_path / "view.webp", tmp_path / "unfinished"
    monkeypatch.setattr("experiments.study.plan.view_path", lambda *_: picture)
    with serving(tmp_path, study) as client:
        assert (
            'class="view" role="img" aria-label="The largest room of the apartment"' in client.get("/").text
        )
        with monkeypatch.context() as impatient:
            impatient.setattr("experiments.visit.server.app.DRAWING_TIMEOUT", 0.0)
            assert client.get("/house.webp").status_code == 404
        picture.touch()  # it cannot be drawn
        began = time.monotonic()
        assert client.get("/house.webp").status_code == 404 and time.monotonic() - began < 30.0
        assert 'class="view"' not in client.get("/").text
        picture.unlink()
        unfinished.write_bytes(b"a picture")
        drawing = threading.Timer(0.5, lambda: unfinished.rename(picture))
        drawing.start()
        answer = client.get("/house.webp")
        drawing.join()
    assert (answer.content, answer.headers["content-type"]) == (b"a picture", "image/webp")
    assert answer.headers["cache-control"] == "no-cache"  # another house may be served next


def test_the_film_shows_its_poster(tmp_path, study, monkeypatch):
    monkeypatch.setattr("experiments.study.plan.poster", lambda film: f"data:,{film.name}")
    with serving(tmp_path, study) as client:
        link = begin(client)
        go_to(client, link, study, "flythrough")
        assert 'poster="data:,film.mp4"' in client.get(link).text


def test_how_much_of_the_film_was_played_is_kept_also_if_it_is_not_required(client, study, tmp_path):
    link = begin(client)
    go_to(client, link, study, "flythrough")
    send_shown(client, link, played_s="12.5", film_s="88", film_error="")
    assert phase(client, link) == "comprehension"
    with closing(sqlite3.connect(tmp_path / "study.db")) as database:
        played = dict(database.execute("SELECT item, value FROM answer WHERE phase = 'flythrough'"))
    assert played == {"played_s": "12.5", "film_s": "88.0"}


def test_answers_are_kept_as_they_are_given(client, study, tmp_path):
    link = begin(client)
    go_to(client, link, study, "survey")
    hostile = "<script>alert(1)</script> '; DROP TABLE person; --"
    kept = post(client, f"{link}/answers", phase="survey", useful="2", comments=hostile, age="7")
    assert kept.status_code == 204
    assert post(client, f"{link}/answers", phase="story", useful="5").status_code == 204  # of another page
    client.close()
    with serving(tmp_path, study) as later:  # the server was restarted
        text = later.get(link).text
        assert re.search(r'checked[^>]*name="useful"[^>]*value="2"', text)
        assert "&lt;script&gt;" in text and "<script>alert" not in text
        assert "Please answer this question" in send_shown(later, link, useful="3")
        text = later.get(link).text
        assert "Please answer" not in text and re.search(r'checked[^>]*name="useful"[^>]*value="3"', text)


def test_a_trial_is_left_only_with_the_study(client, study):
    link = begin(client)
    go_to(client, link, study, "training")
    assert f'data-leave="{link}/withdrawal"' in client.get(link).text
    with connected(client, link) as socket:
        started(socket, "training")
        socket.send_json({"type": "leave"})
        assert until(socket, "error")[-1]["code"] == "too early"
    assert phase(client, link) == "training"


def test_minimum_times_hold(tmp_path, study):
    slow = dataclasses.replace(
        study, settings=msgspec.structs.replace(study.settings, minimum={"consent": 60})
    )
    with serving(tmp_path, slow) as client:
        link = begin(client)
        assert "take the time" in send_shown(client, link, agree="yes")
        assert phase(client, link) == "consent"


def test_who_may_skip_a_phase_need_not_wait(tmp_path, study):
    settings = msgspec.structs.replace(study.settings, minimum={"story": 60}, optional=("device", "story"))
    with serving(tmp_path, dataclasses.replace(study, settings=settings)) as client:
        link = begin(client)
        assert 'name="skip"' not in client.get(link).text
        post(client, link, phase="consent", skip="yes", agree="")
        assert phase(client, link) == "consent", "consent cannot be skipped"
        post(client, link, phase="consent", agree="yes")
        for name, following in (("device", "story"), ("story", "flythrough")):
            assert 'name="skip"' in client.get(link).text
            post(client, link, phase=name, skip="yes")
            assert phase(client, link) == following


def test_pages_without_javascript_say_so(client, study):
    link, names = begin(client), study.settings.phases[:-1]
    assert study.texts["common"]["needs_script"] in client.get("/").text
    for name in names:
        go_to(client, link, study, name)
        text = client.get(link).text
        assert re.search(r"<noscript>.*?JavaScript.*?</noscript>", text, re.S), name


def test_who_does_not_read_the_survey_ends_with_a_clear_page(tmp_path, study):
    survey = study.texts["survey"]
    first, *others = survey.items
    checked = msgspec.structs.replace(survey, items=(msgspec.structs.replace(first, right=1), *others))
    limits = msgspec.structs.replace(study.settings.limits, inattentive=0)
    settings = msgspec.structs.replace(study.settings, limits=limits)
    strict = dataclasses.replace(study, settings=settings, texts={**study.texts, "survey": checked})
    with serving(tmp_path, strict) as client:
        link = begin(client)
        go_to(client, link, strict, "survey")
        post(client, link, phase="survey", **survey_answers(strict))
        assert "whether you read them carefully" in client.get(link).text
        assert phase(client, link) is None


def test_leaving_deletes_what_was_played_if_wanted(client, study, tmp_path):
    for data, left in (("keep", 1), ("delete", 0)):
        link = begin(client)
        go_to(client, link, study, "survey")
        before = len(list((tmp_path / "visits").iterdir()))
        assert "Leave the study?" in client.get(f"{link}/withdrawal").text
        post(client, f"{link}/withdrawal", data=data)
        assert "You have left the study" in client.get(link).text
        assert len(list((tmp_path / "visits").iterdir())) == before - 1 + left


def test_a_database_that_fails_pauses_the_study(client, monkeypatch):
    link = begin(client)

    async def fail(*_, **__):
        raise StoreError("the disk is full")

    with monkeypatch.context() as broken:
        broken.setattr(Store, "finish_phase", fail)
        answer = post(client, link, phase="consent", agree="yes")
    assert answer.status_code == 503 and "come back later" in answer.text
    assert phase(client, link) == "consent"


def test_strangers_get_nothing(client, study):
    link = begin(client)
    other = "/play/" + "x" * 43
    for path in (other, f"{other}/film", f"{other}/withdrawal", "/play/short", "/nothing"):
        assert client.get(path).status_code == 404
    assert (
        client.post(link, data={"phase": "consent", "agree": "yes"}).status_code == 403
    )  # from another site
    assert phase(client, link) == "consent"
    assert study.settings.contact in client.get(link).text
