"""Platforms: who comes, who is recognised, and where people are sent back to."""

import dataclasses
import functools
import logging
import sqlite3
import time

import msgspec
import pytest

from experiments.errors import ConfigError, StoreError
from experiments.study.file import Recruitment, read_people_study
from experiments.study.recruitment import recruiter
from experiments.trials.designs import FOLDER
from experiments.visit.recruiter import InvalidLink, OpenLink, Preview, WayBack
from experiments.visit.store import Store
from experiments.visit.tokens import new_token, token_hash
from tests.experiments.visit.server.test_server import begin, go_to, phase, play_trial, post, serving
from tests.scripted_workers import LAST, connected, started, until_phase

CODES = {"completed": "C0MPLETE", "screened_out": "SCREEN0UT", "no_consent": "N0C0NSENT"}
PROLIFIC = Recruitment(platform="prolific", study_id="study0000001", **CODES)
IDS = {"PROLIFIC_PID": "person000001", "STUDY_ID": "study0000001", "SESSION_ID": "session00001"}


def test_people_of_prolific_are_known_by_their_id_and_return_with_a_code():
    platform = recruiter(PROLIFIC)
    came = platform.arrive(IDS)
    assert (came.key, came.identity) == (IDS["PROLIFIC_PID"], IDS)
    for how, code in (("finished", "C0MPLETE"), ("screened_out", "SCREEN0UT"), ("no_consent", "N0C0NSENT")):
        back = platform.way_back(how, IDS)
        assert (back.code, back.url) == (code, f"https://app.prolific.com/submissions/complete?cc={code}")
    assert platform.way_back("withdrawn", IDS).url == ""


@pytest.mark.parametrize(
    "change",
    [
        {"PROLIFIC_PID": ""},
        {"PROLIFIC_PID": "<script>"},
        {"STUDY_ID": "another00001"},
        {"SESSION_ID": "x" * 999},
    ],
)
def test_links_that_are_not_the_platforms_are_refused(change):
    assert isinstance(recruiter(PROLIFIC).arrive({**IDS, **change}), InvalidLink)


@pytest.mark.parametrize("name", list(CODES))
def test_a_missing_code_is_named(name):
    with pytest.raises(ConfigError, match=f"study.recruitment.{name} is empty"):
        recruiter(msgspec.structs.replace(PROLIFIC, **{name: ""}))


def test_people_of_connect_are_known_by_their_id_and_return_to_the_page_with_the_code():
    platform = recruiter(Recruitment(platform="connect", completed="DC6CDE9748", study_id="0123ABCD"))
    ids = {"participantId": "P00001", "assignmentId": "A00001", "projectId": "0123ABCD"}
    came = platform.arrive(ids)
    assert (came.key, came.identity) == ("P00001", ids)
    assert isinstance(platform.arrive({**ids, "projectId": "0123ABCE"}), InvalidLink)
    assert isinstance(platform.arrive({**ids, "participantId": ""}), InvalidLink)
    url = "https://connect.cloudresearch.com/participant/project/DC6CDE9748/complete"
    assert platform.way_back("finished", ids).url == url
    assert platform.way_back("screened_out", ids).gives_back


def test_a_link_is_open_to_all_and_a_link_to_play_again_carries_the_token_of_the_earlier_visit():
    earlier = new_token()
    again, once = OpenLink(repeats=True), OpenLink()
    assert (again.platform, again.parameters, once.parameters) == ("link", ("after",), ())
    assert again.arrive({"after": earlier}).identity == {"after": token_hash(earlier)}
    assert again.arrive({"after": earlier}).key is None
    for query in ({}, {"after": ""}, {"after": "x"}, {"after": earlier + "x"}, {"before": earlier}):
        assert again.arrive(query).identity == {}
    assert once.arrive({"after": earlier}).identity == {}


def test_a_code_is_given_for_a_finished_visit_and_in_a_lab_the_next_person_begins():
    for how in ("finished", "screened_out", "no_consent", "withdrawn", "timed_out"):
        code = "C0DE" if how == "finished" else ""
        assert OpenLink("link", "C0DE").way_back(how, {}) == WayBack(code)
        assert OpenLink("lab", "C0DE").way_back(how, {}) == WayBack(code, "/", label="next_person")


SITE = "https://www.example.org"
QUESTION = Recruitment(platform="external-question", sites=("https://worker.example.org", SITE))
TASK = {"assignmentId": "3ASSIGNMENT", "hitId": "3HIT", "workerId": "A1WORKER", "turkSubmitTo": SITE}


def test_people_of_an_external_question_preview_accept_and_submit():
    platform = recruiter(QUESTION)
    looking = {"assignmentId": "ASSIGNMENT_ID_NOT_AVAILABLE", "hitId": "3HIT"}
    assert isinstance(platform.arrive(looking), Preview)
    came = platform.arrive({**TASK, "turkSubmitTo": f"{SITE}/"})
    assert (came.key, came.identity) == ("A1WORKER", TASK)
    back = platform.way_back("finished", came.identity)
    assert back.url == "https://www.example.org/mturk/externalSubmit"
    assert back.fields["assignmentId"] == "3ASSIGNMENT"
    assert platform.way_back("withdrawn", came.identity).gives_back


@pytest.mark.parametrize(
    "change",
    [
        {"turkSubmitTo": "https://evil.example.org"},
        {"turkSubmitTo": ""},
        {"turkSubmitTo": f"{SITE}.evil.example.org"},
        {"turkSubmitTo": f"{SITE}@evil.example.org"},
        {"turkSubmitTo": "http://www.example.org"},
        {"workerId": ""},
        {"assignmentId": '"><script>'},
    ],
)
def test_no_form_is_sent_where_a_link_says(change):
    assert isinstance(recruiter(QUESTION).arrive({**TASK, **change}), InvalidLink)
    assert recruiter(QUESTION).way_back("finished", {**TASK, "turkSubmitTo": "https://evil"}).url == ""


def test_who_comes_again_is_the_same_person_and_no_id_is_shown(tmp_path, caplog):
    caplog.set_level(logging.INFO)
    with serving(tmp_path, with_recruitment(PROLIFIC)) as client:
        assert client.get("/").status_code == 400, "without ids"
        text = client.get("/", params=IDS).text
        assert all(f'name="{name}" value="{value}"' in text for name, value in IDS.items())
        link = begin(client, **IDS)
        assert begin(client, **IDS) == link
        assert client.get("/", params=IDS).headers["location"] == link
        assert phase(client, link) == "consent"
        pages = client.get(link).text
        post(client, link, phase="consent", agree="no")
        declined = client.get(link).text
        assert "cc=N0C0NSENT" in declined
        assert post(client, "/begin", **{**IDS, "STUDY_ID": "another00001"}).status_code == 400
    shown = (
        pages
        + declined
        + " ".join(r.getMessage() for r in caplog.records if r.name.startswith("mjsim"))
        + " ".join(path.name for path in tmp_path.rglob("*"))
    )
    assert not any(value in shown for value in IDS.values())


@functools.cache
def paper():
    return read_people_study(FOLDER / "paper.toml")


def with_recruitment(recruitment, **limits):
    study = paper()
    settings = msgspec.structs.replace(study.settings, recruitment=recruitment, minimum={})
    limits = msgspec.structs.replace(settings.limits, **limits)
    return dataclasses.replace(study, settings=msgspec.structs.replace(settings, limits=limits))


def test_a_task_is_looked_at_before_it_is_accepted_and_given_back_and_accepted_again(tmp_path):
    with serving(tmp_path, with_recruitment(QUESTION)) as client:
        looking = client.get("/", params={**TASK, "assignmentId": "ASSIGNMENT_ID_NOT_AVAILABLE"})
        assert "This is a preview" in looking.text and "<form" not in looking.text
        assert post(client, "/begin", assignmentId="ASSIGNMENT_ID_NOT_AVAILABLE").status_code == 400
        link = begin(client, **TASK)
        again = {**TASK, "assignmentId": "4ASSIGNMENT"}
        elsewhere = client.get("/", params=again)
        assert elsewhere.status_code == 403 and "returning.js" in elsewhere.text
        token = link.rsplit("/", 1)[1]
        assert token not in elsewhere.text
        assert begin(client, **again, token=token) == link, "the browser in which it began has the link"
        with sqlite3.connect(tmp_path / "study.db") as database:
            assert "4ASSIGNMENT" in database.execute("SELECT ids FROM identity").fetchone()[0]
            database.execute("UPDATE person SET phase = 'completion', status = 'finished'")
        database.close()
        end = client.get(link)
        assert f'action="{SITE}/mturk/externalSubmit"' in end.text and "4ASSIGNMENT" in end.text
        begin(client, **{**TASK, "assignmentId": "5ASSIGNMENT"}, token=token)
        assert "4ASSIGNMENT" in client.get(link).text, "what was submitted is what is paid"


def test_only_the_platform_may_embed_the_study(tmp_path):
    for recruitment, frames in ((QUESTION, " ".join(QUESTION.sites)), (PROLIFIC, "'none'")):
        folder = tmp_path / recruitment.platform
        folder.mkdir()
        with serving(folder, with_recruitment(recruitment)) as client:
            headers = client.get("/", params=TASK).headers
            assert f"frame-ancestors {frames}" in headers["content-security-policy"]
            assert ("x-frame-options" in headers) is (recruitment is PROLIFIC)


def test_in_a_lab_nothing_leads_back_to_the_person_before(tmp_path):
    with serving(tmp_path, with_recruitment(Recruitment(platform="lab"))) as client:
        welcome = client.get("/").text
        assert "start.js" not in welcome and "data-forgets" in welcome
        first, second = begin(client), begin(client)
        assert first != second
        post(client, first, phase="consent", agree="no")
        end = client.get(first)
        assert (
            "Start with the next participant" in end.text
            and 'href="/"' in end.text
            and "data-forgets" in end.text
        )
        assert phase(client, second) == "consent"
        assert all("set-cookie" not in client.get(path).headers for path in ("/", first, second))


def test_who_never_comes_back_has_timed_out_and_gives_the_place_away(tmp_path, monkeypatch):
    monkeypatch.setattr("experiments.visit.server.background.SWEEP_S", 0.1)
    study = with_recruitment(PROLIFIC, abandoned_after=0.5, timed_out_after=0.5)
    with serving(tmp_path, study) as client:
        link = begin(client, **IDS)
        go_to(client, link, study, "training")
        until = time.monotonic() + 10.0
        while "Your time is up" not in client.get(link).text:
            assert time.monotonic() < until
            time.sleep(0.1)
        assert "return the task" in client.get(link).text
        assert client.get("/", params=IDS).headers["location"] == link, "there is no second participation"
        assert client.get(f"{link}/withdrawal").status_code == 404
        with sqlite3.connect(tmp_path / "study.db") as database:
            assert database.execute("SELECT status FROM person").fetchall() == [("timed_out",)]
            assert database.execute("SELECT state FROM assignment").fetchall() == [("released",)]
        database.close()


def test_a_task_that_was_over_when_its_page_was_closed_is_noted(tmp_path, monkeypatch):
    monkeypatch.setattr("experiments.visit.server.background.SWEEP_S", 0.1)
    study = with_recruitment(PROLIFIC, abandoned_after=3.0, timed_out_after=3.0)
    with serving(tmp_path, study) as client:
        link = begin(client, **IDS)
        go_to(client, link, study, "task")
        play_trial(client, link, "task")
        until, noted = time.monotonic() + 20.0, []
        while not noted:
            assert time.monotonic() < until
            time.sleep(0.1)
            with sqlite3.connect(tmp_path / "study.db") as database:
                noted = database.execute("SELECT ended FROM trial WHERE phase = 'task'").fetchall()
            database.close()
        assert "Your opinion" in client.get(link).text


@pytest.mark.slow
def test_a_task_whose_end_the_database_refused_is_recorded_before_its_participant_times_out(
    tmp_path, monkeypatch
):
    monkeypatch.setattr("experiments.visit.server.background.SWEEP_S", 0.1)
    finish_trial, refused = Store.finish_trial, []

    async def refuse_once(self, *arguments):
        if not refused:
            refused.append(arguments)
            raise StoreError("the database is away")
        return await finish_trial(self, *arguments)

    study = with_recruitment(PROLIFIC, abandoned_after=3.0, timed_out_after=3.0)
    with serving(tmp_path, study) as client:
        link = begin(client, **IDS)
        go_to(client, link, study, "task")
        monkeypatch.setattr(Store, "finish_trial", refuse_once)
        with connected(client, link) as socket:
            started(socket, "task")
            socket.send_json({"type": "inputs", "inputs": [{"number": 1, "scroll": LAST}]})
            until_phase(socket, "failed")
        until, recorded = time.monotonic() + 20.0, []
        while not recorded:
            assert time.monotonic() < until
            time.sleep(0.1)
            with sqlite3.connect(tmp_path / "study.db") as database:
                recorded = database.execute("SELECT ended FROM trial WHERE phase = 'task'").fetchall()
                status = database.execute("SELECT status FROM person").fetchall()
            database.close()
        assert refused and status == [("assigned",)]
        assert "Your opinion" in client.get(link).text
