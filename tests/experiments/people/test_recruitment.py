"""Platforms: who comes, who is recognised, and where people are sent back to."""

import dataclasses
import logging

import msgspec
import pytest

from experiments.errors import ConfigError
from experiments.people.recruitment import recruiter
from experiments.people.recruitment.base import Refusal
from experiments.people.study_file import Recruitment, read_people_study
from experiments.study.designs import FOLDER
from tests.experiments.people.test_server import begin, phase, post, serving

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
    assert isinstance(recruiter(PROLIFIC).arrive({**IDS, **change}), Refusal)


@pytest.mark.parametrize("name", list(CODES))
def test_a_missing_code_is_named(name):
    with pytest.raises(ConfigError, match=f"study.recruitment.{name}"):
        recruiter(msgspec.structs.replace(PROLIFIC, **{name: ""}))


def test_a_platform_that_cannot_be_served_is_named():
    with pytest.raises(ConfigError, match="connect"):
        recruiter(Recruitment(platform="connect"))


def test_who_comes_again_is_the_same_person_and_no_id_is_shown(tmp_path, caplog):
    study = read_people_study(FOLDER / "paper.toml")
    settings = msgspec.structs.replace(study.settings, recruitment=PROLIFIC, minimum={})
    caplog.set_level(logging.INFO)
    with serving(tmp_path, dataclasses.replace(study, settings=settings)) as client:
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
