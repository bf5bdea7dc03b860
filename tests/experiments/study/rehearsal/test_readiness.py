"""`mjsim study check`: what is not ready is listed with its line; a dry run goes through every phase."""

import asyncio
import dataclasses
import json
import re

import httpx
import msgspec
import pytest
from scripted_workers import LAST, ScriptedPool, hello
from websockets.asyncio.client import connect

from experiments.cli.main import main
from experiments.study.file import read_people_study
from experiments.study.plan import plan_of
from experiments.study.recruitment import recruiter
from experiments.study.rehearsal import dry_run as runs
from experiments.study.rehearsal.costs import TrialDurations, cost, detectable, durations
from experiments.study.rehearsal.person import SimulatedPerson
from experiments.study.rehearsal.pictures import browser
from experiments.study.rehearsal.problems import located, problems_of_file, problems_of_length
from experiments.visit.phases import phases_of
from experiments.visit.phases.base import Done, FormPhase
from experiments.visit.texts import languages

ENDS = {"type": "inputs", "inputs": [{"number": 1, "scroll": LAST}]}
STUDY = """\
[all_cells]
user = "guest"
house_seeds = 57

[[cells]]
assistance = "none"
objects = 1
people = 2

[[cells]]
assistance = "optimal"
objects = 1
seeds = "2:4"

[study]
name = "small"
title = "Tidying up"
institution = "A university"
contact = "people@university.edu"
minutes = 10

[study.pay]
reward = 2.0
fee = 0.5
bonus_for_all = 1.0

[study.minimum]
story = 20
"""


@pytest.fixture
def study(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(STUDY)
    return read_people_study(path)


def with_text(tmp_path, **replaced):
    text = STUDY
    for before, after in replaced.values():
        assert before in text
        text = text.replace(before, after)
    path = tmp_path / "other.toml"
    path.write_text(text)
    return read_people_study(path)


def test_a_good_file_has_no_problems(study):
    assert not list(problems_of_file(study))


@pytest.mark.parametrize(
    ("before", "after", "line", "said"),
    [
        ("people@university.edu", "you@example.org", 19, "working address"),
        ("A university", "your institution", 18, "name your institution"),
        ("reward = 2.0", "reward = 2.0\nwage = 15.0", 23, "12.00 an hour, below the wage of 15.00"),
        (
            "bonus_for_all = 1.0",
            'screen_out = 1.0\n[study.recruitment]\nplatform = "prolific"',
            26,
            "completed",
        ),
        ("people = 2", "people = 1", 16, "one person"),
    ],
)
def test_problems_name_file_and_line(tmp_path, before, after, line, said):
    changed = with_text(tmp_path, only=(before, after))
    (found,) = located(changed, problems_of_file(changed))
    assert found.startswith(f"{changed.path}, line {line}: ") and said in found


CODES = 'completed = "A"\nscreened_out = "B"\nno_consent = "C"'


@pytest.mark.parametrize(("amount", "line"), [("\nscreen_out = 0.00", 26), ("", 22)])
def test_people_of_a_platform_are_not_screened_out_without_pay(tmp_path, amount, line):
    recruitment = f'bonus_for_all = 1.0{amount}\n[study.recruitment]\nplatform = "prolific"\n{CODES}'
    changed = with_text(tmp_path, only=("bonus_for_all = 1.0", recruitment))
    (found,) = located(changed, problems_of_file(changed))
    assert f"line {line}: screen_out is 0.00" in found


@pytest.mark.parametrize("language", languages())
def test_the_consent_text_says_who_is_paid_what_and_how_long_data_are_kept(tmp_path, language):
    texts = {}
    for name, more in (
        ("unpaid", ""),
        ("paid", "screen_out = 0.5\npartial = true\n[study.limits]\nkeep_days = 90"),
    ):
        changed = (
            ("bonus_for_all = 1.0", f"bonus_for_all = 1.0\n{more}"),
            ("minutes = 10", f'minutes = 10\nlanguage = "{language}"'),
        )
        study = with_text(tmp_path, one=changed[0], other=changed[1])
        assert not list(problems_of_file(study))
        texts[name] = "\n".join(study.texts["consent"].paragraphs())
        assert "A university" in texts[name] and "{" not in texts[name]
    assert "0.50 USD" in texts["paid"] and "90 " in texts["paid"]
    assert study.texts["consent"]["stop_partial"] in texts["paid"]
    assert study.texts["consent"]["stop_unpaid"] in texts["unpaid"]


def test_a_consent_text_that_lacks_something_is_a_problem(tmp_path):
    (tmp_path / "texts.toml").write_text(
        '[consent]\ntext = "You may write to {contact}. We delete data after 3 months."\n'
    )
    changed = with_text(tmp_path, only=("minutes = 10", 'minutes = 10\ntexts = "texts.toml"'))
    (found,) = located(changed, problems_of_file(changed))
    lacking = (
        "the legal basis, the participant's rights, the pay of a participant who stops early, the controller"
    )
    assert f"line 21: the consent text does not name {lacking};" in found


def test_minutes_that_contradict_the_length_are_a_problem(study):
    assert not list(problems_of_length(study, 400.0, 700.0))
    assert "11 to 20" in next(problems_of_length(study, 660.0, 1200.0))[1]
    assert "2 to 3" in next(problems_of_length(study, 120.0, 180.0))[1]


def test_cost_length_and_power(study):
    found = cost(study)
    assert (found.rewards, found.bonuses, found.fee, found.total, found.hourly) == (8.0, 4.0, 6.0, 18.0, 12.0)
    shorter = dataclasses.replace(
        study,
        settings=msgspec.structs.replace(study.settings, phases=("consent", "story", "task", "completion")),
    )
    played = TrialDurations(60.0, {"none": 100.0, "optimal": 80.0})
    seconds = durations(shorter, phases_of(plan_of(shorter)), {"consent": 238, "story": 10}, played)
    assert seconds == {"consent": 60.0, "story": 20.0, "task": 90.0, "completion": 0.0}
    assert detectable(study).keys() == {"assistance"}
    assert 0.5 < detectable(study)["assistance"] < 1.0


class _Sloppy(FormPhase):
    """A survey that takes anything."""

    def read(self, *_):
        return Done({})


@pytest.fixture
def quick(monkeypatch):
    """Nobody plays a trial or waits long in the queue."""
    monkeypatch.setattr(SimulatedPerson, "_play", _play_nothing)
    monkeypatch.setattr("experiments.study.rehearsal.person.QUEUE_PAUSE", 0.1)


def _walked(study, folder, monkeypatch, phases=None):
    """Names of the pictures of a dry run; those of a study that admits nobody map to the pages."""
    pictures = {}

    async def photograph(name, url, _):
        pictures[name] = ""
        if name in ("paused", "full"):
            async with httpx.AsyncClient() as client:
                pictures[name] = (await client.get(url)).text

    if phases:
        monkeypatch.setattr("experiments.visit.procedure.phases_of", lambda _: phases)
    walked = asyncio.run(
        runs.dry_run(study, recruiter(study.settings.recruitment), folder, ScriptedPool(), photograph)
    )
    return walked, pictures


@pytest.mark.slow
@pytest.mark.usefixtures("quick")
def test_a_dry_run_goes_every_way_that_there_is(study, tmp_path, monkeypatch):
    walked, pictures = _walked(study, tmp_path, monkeypatch)
    (unplayed,) = walked.faults
    assert "the run that was recorded cannot be used" in unplayed
    refused = {name: f"{name}-refused" for name in ("consent", "device", "comprehension", "survey")}
    more = {**refused, "comprehension-refused": "queue", "task": "help"}
    phases = []
    for phase in study.settings.phases[:-1]:
        while phase is not None:
            phases.append(phase)
            phase = more.get(phase)
    assert list(pictures) == [
        "welcome", *phases, "finished", "consent-no_consent", "device-screened_out",
        "comprehension-screened_out", "withdrawal", "withdrawn", "timed_out", "paused", "full",
    ]  # fmt: skip
    assert walked.words["consent"] > 100 and walked.words["survey"] > 200


@pytest.mark.slow
@pytest.mark.usefixtures("quick")
def test_a_dry_run_shows_the_markers_of_each_condition_if_they_are_explained(tmp_path, monkeypatch):
    phases = 'phases = ["consent", "task", "debriefing", "completion"]'
    changed = with_text(
        tmp_path,
        phases=("minutes = 10", f"minutes = 10\n{phases}\nexplain_markers = true"),
        minimum=("story = 20", ""),
    )
    _, pictures = _walked(changed, tmp_path, monkeypatch)
    conditions = [
        f"task-{name}" for name in dict.fromkeys(cell.trials[0].assistance for cell in changed.cells)
    ]
    assert [name for name in pictures if name.startswith("task-")] == conditions


async def _play_nothing(self, trial, leaves):  # noqa: ARG001 - everybody stays
    """The trial is over at once; what is tested here is what is around it."""
    address = self._around.base.replace("http", "ws", 1) + self.rehearsed.link
    async with connect(address, origin=self._around.base) as socket:
        for message in (hello(trial), {"type": "run"}, ENDS):
            await socket.send(json.dumps(message))
            if message["type"] == "hello":
                while json.loads(await socket.recv()).get("phase") != "ready":
                    pass
        while json.loads(await socket.recv())["type"] != "saved":
            pass
    return True


@pytest.mark.slow
@pytest.mark.parametrize(
    "settings",
    [
        'platform = "prolific"\ncompleted = "C1"\nscreened_out = "C2"\nno_consent = "C3"\nstudy_id = "5f000000"',
        'platform = "connect"\ncompleted = "CODE1"\nstudy_id = "5f00000000"',
        'platform = "external-question"\nsites = ["https://platform.example.org"]',
        'platform = "lab"',
    ],
)
@pytest.mark.usefixtures("quick")
def test_a_dry_run_comes_from_each_platform(tmp_path, monkeypatch, settings):
    phases = 'phases = ["consent", "task", "debriefing", "completion"]'
    changed = with_text(
        tmp_path,
        phases=("minutes = 10", f"minutes = 10\n{phases}\n[study.recruitment]\n{settings}"),
        minimum=("story = 20", ""),
    )
    walked, pictures = _walked(changed, tmp_path, monkeypatch)
    assert ("returning" in pictures) is ("sites" in settings or "5f000000" in settings)
    assert [fault for fault in walked.faults if "cannot be used" not in fault] == []
    assert (
        "Nobody can start at the moment" in pictures["paused"]
        and "No more participants needed" in pictures["full"]
    )


@pytest.mark.usefixtures("quick")
def test_a_dry_run_finds_a_phase_that_takes_anything(tmp_path, monkeypatch):
    short = 'minutes = 10\nphases = ["consent", "task", "survey", "completion"]'
    study = with_text(tmp_path, phases=("minutes = 10", short), minimum=("story = 20", ""))
    phases = [
        _Sloppy(plan_of(study), "survey") if p.name == "survey" else p for p in phases_of(plan_of(study))
    ]
    walked, _ = _walked(study, tmp_path, monkeypatch, phases)
    assert "survey accepts a form that it should refuse" in walked.faults


@pytest.mark.slow
def test_the_command_plays_takes_pictures_and_says_what_is_missing(tmp_path, capsys):
    short = with_text(
        tmp_path,
        phases=("minutes = 10", 'minutes = 10\nphases = ["consent", "training", "task", "completion"]'),
        minimum=("story = 20", "consent = 1"),
        contact=("people@university.edu", "nobody"),
    )
    assert main(["study", "check", str(short.path), "--out", str(tmp_path / "pictures")]) == 1
    said = capsys.readouterr().out
    assert "line 19: contact is 'nobody'" in said
    assert re.search(r"not ready \(problems: [12]\)", said)  # minutes depend on the simulated people
    assert "18.00 USD in total" in said and "partial eta squared" in said
    if browser():
        assert {path.name for path in (tmp_path / "pictures").glob("*-consent-*.png")} >= {
            "02-consent-desk.png", "02-consent-phone.png",
        }  # fmt: skip
        assert "-task-phone.png" in (tmp_path / "pictures" / "index.html").read_text()
