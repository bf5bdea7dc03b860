"""Columns of a study's table: which answers, durations and counts of a participant they hold."""

import datetime
from types import SimpleNamespace

import pytest

from experiments.analysis.study.measures import SurveyScale
from experiments.errors import ConfigError, RecordError
from experiments.study.data.collect import (
    Collected,
    _about,
    _answers,
    _complete,
    _texts,
    check_people,
    person_name,
    person_number,
    visit_name,
    write_collected,
)
from experiments.trials.table import read_rows
from experiments.visit.store import Answer, PhaseRow, TrialRow
from experiments.visit.texts.items import Item

NOW = datetime.datetime(2026, 11, 27, 12, 30, 15, 999_999, tzinfo=datetime.UTC)
ITEMS = [
    Item("useful", "scale", "It was useful."),
    Item("tools", "several", "I use", choices=["pen", "phone", "none"]),
    Item("hand", "choice", "My hand", choices=["left", "right"]),
    Item("age", "number", "My age"),
    Item("comments", "text", "Comments"),
    Item("job", "line", "My job"),
    Item("careful", "scale", "Choose 2.", right=2),
    Item("colour", "choice", "Choose red.", choices=["red", "blue"], right="red"),
]


def answer(item, value, phase="survey", *, person=7, final=True):
    return Answer(person, phase, item, value, NOW, final)


def test_each_kind_of_item_has_a_column_and_free_texts_have_none():
    given = {
        "useful": 4,
        "tools": ["pen", "phone"],
        "hand": "left",
        "age": 40,
        "comments": "hi",
        "job": "cook",
    }
    columns = _answers(ITEMS[:6], [answer(item, value) for item, value in given.items()])
    assert columns == {
        "likert_useful": 4,
        "answer_tools": "pen; phone",
        "answer_hand": "left",
        "answer_age": 40,
    }
    nothing = {"likert_useful": None, "answer_tools": None, "answer_hand": None, "answer_age": None}
    assert _answers(ITEMS[:6], []) == nothing
    assert _answers(ITEMS[:6], [answer("tools", [])])["answer_tools"] == ""
    drafts = [answer(item, value, final=False) for item, value in given.items()]
    assert _answers(ITEMS[:6], drafts) == nothing, "answers of a form that was not sent do not count"
    assert _answers(ITEMS[:6], [answer(item, value, "story") for item, value in given.items()]) == {
        **nothing,
        "story_useful": 4,
        "story_age": 40,
    }


@pytest.mark.parametrize(
    ("careful", "colour", "wrong"),
    [(2, "red", 0), (3, "red", 1), (2, "blue", 1), (1, "blue", 2), (None, "red", 1), (None, None, 2)],
)
def test_wrong_and_missing_answers_of_attention_checks_are_counted(careful, colour, wrong):
    given = [answer("careful", careful), answer("colour", colour)]
    columns = _answers(ITEMS, [one for one in given if one.value is not None])
    assert columns["inattentive"] == wrong
    other_phase = [answer("careful", 2, "quiz"), answer("colour", "red", final=False)]
    assert _answers(ITEMS, other_phase)["inattentive"] == 2
    assert "inattentive" not in _answers(ITEMS[:6], given)


def test_numbers_of_other_phases_are_columns_and_their_texts_are_not():
    given = [
        answer("agreed", True, "consent"),
        answer("fps", 59.5, "device"),
        answer("count", 3, "device"),
        answer("browser", "Firefox", "device"),
        answer("list", [1, 2], "device"),
        answer("draft", 5, "device", final=False),
    ]
    assert _answers([], given) == {"consent_agreed": True, "device_fps": 59.5, "device_count": 3}


def test_free_texts_are_those_of_the_survey_by_people_whose_data_are_kept():
    people = [SimpleNamespace(id=7), SimpleNamespace(id=12)]
    given = [
        answer("comments", "one"),
        answer("job", "two", person=12),
        answer("comments", "of an excluded participant", person=8),
        answer("comments", "a draft", final=False),
        answer("comments", "elsewhere", "story"),
        answer("hand", "left"),
    ]
    assert _texts(ITEMS, people, given) == [("p00007", "comments", "one"), ("p00012", "job", "two")]


def test_a_row_says_when_a_person_came_and_how_long_each_phase_took():
    person = SimpleNamespace(id=3, platform="link", status="finished", created=NOW)
    trial = TrialRow(3, "task", "visits/x/task", "all delivered", NOW + datetime.timedelta(hours=1))
    phases = [
        PhaseRow(3, "consent", NOW, NOW, 12.5, None),
        PhaseRow(3, "task", NOW, None, None, None),
        PhaseRow(3, "own-phase", NOW, NOW, 1.0, None),
    ]
    assert _about(person, trial, phases) == {
        "participant": "p00003",
        "platform": "link",
        "status": "finished",
        "arrived": "2026-11-27T12:30:15+00:00",
        "task_ended": "2026-11-27T13:30:15+00:00",
        "phase_consent_s": 12.5,
        "phase_task_s": None,
    }


def test_all_rows_have_the_columns_of_every_row_in_the_order_in_which_they_appear():
    rows = _complete([{"a": 1, "c": 2}, {"b": 3, "a": 4}, {}])
    assert [list(row) for row in rows] == [["a", "c", "b"]] * 3
    assert rows[1] == {"a": 4, "c": None, "b": 3} and set(rows[2].values()) == {None}
    assert _complete([]) == []


@pytest.mark.parametrize("number", [0, 7, 12345, 123456, 999_999_999])
def test_a_name_in_a_table_leads_back_to_the_person(number):
    name = person_name(SimpleNamespace(id=number))
    assert name.startswith("p") and len(name) >= 6
    assert person_number(name) == person_number(str(number)) == number


@pytest.mark.parametrize(
    "text", ["", "p", "q00012", "p-1", "12 ", "p1.0", "1234567890", "\N{ARABIC-INDIC DIGIT ONE}"]
)
def test_other_names_are_refused(text):
    with pytest.raises(ConfigError, match="is no person; tables name people like p00012"):
        person_number(text)


def test_names_of_visits_do_not_contain_their_links_and_differ():
    names = {visit_name(f"{'a' * 60}{k:04}") for k in range(500)}
    assert len(names) == 500 and {len(name) for name in names} == {9}
    assert not any("aaaa" in name for name in names)


@pytest.mark.parametrize(
    ("rehearsal", "platforms", "fault"),
    [
        (False, ["link", "prolific"], None),
        (True, ["rehearsal"] * 2, None),
        (True, [], None),
        (False, [], None),
        (False, ["link", "rehearsal", "link"], "1 of 3 people are simulated"),
        (True, ["link", "rehearsal", "link"], "2 of 3 people are no rehearsal"),
    ],
)
def test_simulated_and_real_people_are_never_mixed(rehearsal, platforms, fault):
    study, people = (
        SimpleNamespace(rehearsal=rehearsal),
        [SimpleNamespace(platform=name) for name in platforms],
    )
    if fault is None:
        check_people(study, people)
        return
    with pytest.raises(RecordError, match=fault):
        check_people(study, people)


@pytest.mark.parametrize("survey", [None, SurveyScale(7, {"useful": "It was useful."})])
def test_tables_are_written_into_a_new_private_folder_and_over_those_of_before(tmp_path, survey):
    out = tmp_path / "new" / "tables"
    for name in ("p00001", "p00002"):
        rows, texts = [{"participant": name, "time": 1.5}], [(name, "comments", "=1+1")]
        written = write_collected(Collected(rows, texts, {}, {}, survey), out)
    assert {path.name for path in written} == {"trials.parquet", "trials.csv", "texts.csv"}
    assert out.stat().st_mode & 0o777 == 0o700
    assert {path.stat().st_mode & 0o777 for path in written} == {0o600}
    assert [row["participant"] for row in read_rows(out / "trials.parquet")] == ["p00002"]
    assert (out / "texts.csv").read_text() == "participant,item,text\np00002,comments,'=1+1\n"
    assert (out / "survey.json").exists() == (survey is not None)
    assert (out / "copies.jsonl").read_bytes() == b""
    assert (out / "copies.jsonl").stat().st_mode & 0o777 == 0o600
