"""Phases: what they show, what they take, and what they refuse."""

import dataclasses

import msgspec
import pytest
from starlette.datastructures import ImmutableMultiDict

from experiments.errors import ConfigError
from experiments.study.file import read_people_study
from experiments.study.plan import plan_of
from experiments.trials.designs import FOLDER
from experiments.visit.phases import phases_of
from experiments.visit.phases.base import Again, Done, Visitor

NOBODY = Visitor({}, 0.0, 0, "/play/x")
GOOD = {"frames_per_s": "60", "latency_ms": "40", "width": "1280", "height": "720", "pixel_ratio": "1"}
GOOD |= {"keyboard": "yes", "webgl": "yes", "renderer": "a card"}


@pytest.fixture(scope="module")
def phases():
    return {phase.name: phase for phase in phases_of(plan_of(read_people_study(FOLDER / "paper.toml")))}


def sent(**values):
    return ImmutableMultiDict(values)


def test_consent_is_given_refused_or_missing(phases):
    consent = phases["consent"]
    assert consent.read(NOBODY, sent(agree="yes")).answers["agreed"] is True
    assert consent.read(NOBODY, sent(agree="no")).outcome == "no_consent"
    assert isinstance(consent.read(NOBODY, sent()), Again)


def test_comprehension_lets_pass_who_knows_and_ends_after_the_attempts(phases):
    check = phases["comprehension"]
    right = {item.name: item.right for item in check.items}
    assert check.read(NOBODY, sent(**right)) == Done(right)
    wrong = sent(**{**right, "hands": "One"})
    assert check.read(NOBODY, wrong).counts
    assert not check.read(NOBODY, sent(hands="One")).counts, "the form is not complete"
    last = dataclasses.replace(NOBODY, attempts=2)
    assert check.read(last, wrong).outcome == "screened_out"
    assert check.read(last, sent(**right)).outcome == "next"


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"frames_per_s": "5"}, "too slowly"),
        ({"latency_ms": "900"}, "connection"),
        ({"keyboard": ""}, "keyboard"),
        ({"width": "500"}, "window"),
        ({"frames_per_s": "nan"}, "JavaScript"),
        ({"width": "x"}, "JavaScript"),
    ],
)
def test_a_computer_that_does_not_fit_is_told_why(phases, change, says):
    device = phases["device"]
    assert isinstance(device.read(NOBODY, sent(**GOOD)), Done)
    again = device.read(NOBODY, sent(**{**GOOD, **change}))
    assert isinstance(again, Again) and says in again.note
    if says != "JavaScript":
        assert device.read(NOBODY, sent(**{**GOOD, **change}, give_up="1")).outcome == "screened_out"


def test_a_computer_without_webgl_may_draw_slowly_since_the_server_draws(phases):
    read = phases["device"].read(NOBODY, sent(**{**GOOD, "webgl": "", "frames_per_s": "2"}))
    assert isinstance(read, Done) and read.answers["webgl"] is False


def test_the_survey_needs_its_scales_and_keeps_numbers(phases):
    survey = phases["survey"]
    scales = {item.name: "4" for item in survey.items if item.kind == "scale"}
    read = survey.read(NOBODY, sent(**scales, age="33", comments="=1+1 <b>"))
    assert isinstance(read, Done)
    assert (
        read.answers["useful"] == 4 and read.answers["age"] == 33 and read.answers["comments"] == "=1+1 <b>"
    )
    assert "gender" not in read.answers  # not answered
    for name, value in [
        ("useful", ""),
        ("useful", "6"),
        ("useful", "x"),
        ("age", "7"),
        ("comments", "x" * 3000),
    ]:
        again = survey.read(NOBODY, sent(**{**scales, name: value}))
        assert isinstance(again, Again)
        assert again.values["form"][name].errors


def test_answers_so_far_are_shown_again(phases):
    page = phases["survey"].page(dataclasses.replace(NOBODY, answers={"useful": 2, "comments": "so far"}))
    form = page.values["form"]
    assert (form["useful"].data, form["comments"].data) == (2, "so far")


def test_own_phases_are_named_by_module_and_attribute():
    study = read_people_study(FOLDER / "paper.toml")
    for name, says in [("nowhere:Phase", "No module"), ("builtins:str", "not all of name")]:
        other = dataclasses.replace(study, settings=_with_phases(study.settings, name))
        with pytest.raises(ConfigError, match=says):
            phases_of(plan_of(other))


def _with_phases(settings, name):
    return msgspec.structs.replace(settings, phases=("task", name, "completion"), minimum={})


CHECKED = """
[survey]
[[survey.item]]
name = "{name}"
kind = "scale"
text = "Please choose 'disagree'."
right = {right}
[[survey.item]]
name = "second"
kind = "choice"
text = "Which one is a colour?"
choices = ["red", "seven"]
right = "red"
required = false
"""


def checked_survey(folder, right=2, **limits):
    """The survey of a study with two checks of attention."""
    (folder / "texts.toml").write_text(CHECKED.format(name="first", right=right))
    text = (FOLDER / "paper.toml").read_text().replace("minutes = 25", 'minutes = 25\ntexts = "texts.toml"')
    entries = "".join(f"{name} = {value}\n" for name, value in limits.items())
    (folder / "study.toml").write_text(f"{text}\n[study.limits]\n{entries}")
    study = read_people_study(folder / "study.toml")
    return next(phase for phase in phases_of(plan_of(study)) if phase.name == "survey")


@pytest.mark.parametrize(
    ("limits", "answers", "outcome"),
    [
        ({}, {"first": "5", "second": "seven"}, "next"),
        ({"inattentive": 1}, {"first": "2", "second": "red"}, "next"),
        ({"inattentive": 1}, {"first": "5", "second": "red"}, "next"),
        ({"inattentive": 1}, {"first": "5"}, "screened_out"),
        ({"inattentive": 0}, {"first": "2", "second": "seven"}, "screened_out"),
    ],
)
def test_who_does_not_read_is_noted_or_screened_out(tmp_path, limits, answers, outcome):
    survey = checked_survey(tmp_path, **limits)
    assert survey.read(NOBODY, sent(**answers)).outcome == outcome
    assert isinstance(survey.read(NOBODY, sent()), Again)
    assert survey.texts["failed_title"] and survey.texts["failed"]


def test_a_right_answer_is_a_point_of_the_scale(tmp_path):
    with pytest.raises(ConfigError, match=r"\[survey\] item first: right is 6"):
        checked_survey(tmp_path, right=6)
