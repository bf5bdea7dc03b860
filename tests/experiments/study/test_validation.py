"""What a study file cannot mean is refused before anything starts, with line, key, value and choices."""

import re

import pytest

from experiments.cli.main import main
from experiments.errors import ConfigError
from experiments.study.validation import check_homes, check_study

STUDY = """\
[all_cells]
user = "guest"
house_seeds = 57
points = 40

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
phases = ["consent", "task", "completion"]
assignment = "balanced"
optional = []

[study.pay]
reward = 2.0
currency = "USD"

[study.minimum]
consent = 1

[study.device]
latency_ms = 500

[study.recruitment]
platform = "link"

[study.limits]
idle = 60
"""
# what is replaced, what stands there then, and parts of the refusal; the key is the first word of what stands there
FAULTS = [
    ('assistance = "none"', 'assistance = "best"', ["'best'", "guided, highlight, none, optimal"]),
    ('assistance = "optimal"', 'assistance = "optimal-dots"', ["'dots'", "minimap"]),
    ('user = "guest"', 'user = "nobody"', ["'nobody'", "follower, guest"]),
    ("points = 40", "points = 2000", ["2000", "fewer points"]),
    ("points = 40", "points = 0", ["0", "at least 1"]),
    ("points = 40", "fidelity = 'half'", ["'half'", "full, event"]),
    ("points = 40", "planner = 'none'", ["'none'", "exact"]),
    ("points = 40", "house = 'nohouse'", ["'nohouse'", "apartment"]),
    ("points = 40", "houses = ['studio', 'nohouse']", ["'nohouse'", "apartment"]),
    ("points = 40", "house = 'generated:x'", ["generated:x", "generated:7"]),
    ("points = 40", "capacity = 3", ["3", "1 or 2"]),
    ("points = 40", "time_limit = -1", ["-1", "positive"]),
    ("points = 40", "draw = 'nobody'", ["'nobody'", "auto, browser, server"]),
    ("points = 40", "regret = 'yes'", ["'yes'", "bool"]),
    ("points = 40", "behaviour = { speed = 1 }", ["'speed'", "temperature"]),
    ("points = 40", "phases = ['nap', 'task']", ["nap", "story, flythrough, training, task"]),
    ("objects = 1\npeople", "objects = 'many'\npeople", ["'many'", "int"]),
    ("objects = 1\npeople", "objects = 60\npeople", ["60", "1 to 40"]),
    ("people = 2", "people = 0", ["0", ">= 1"]),
    ("people = 2", "peple = 2", ["2", "people, person"]),
    ('seeds = "2:4"', 'seeds = "2-4"', ["'2-4'", "0:10"]),
    ('seeds = "2:4"', "seeds = -1", ["-1", "from 0"]),
    ('name = "small"', 'name = "Small Study"', ["'Small Study'", "[a-z0-9]"]),
    ("minutes = 10", "minutes = 0.5", ["0.5", "int"]),
    ('phases = ["consent", "task", "completion"]', 'phases = ["nap", "task"]', ["nap", "completion"]),
    (
        'phases = ["consent", "task", "completion"]',
        'phases = ["consent", "task", "none.of:This", "completion"]',
        ["none.of"],
    ),
    ('assignment = "balanced"', 'assignment = "fair"', ["'fair'", "balanced, uniform"]),
    ('assignment = "balanced"', 'asignment = "fair"', ["'fair'", "assignment"]),
    ('assignment = "balanced"', 'language = "xx"', ["'xx'", "de, en"]),
    ("optional = []", 'optional = ["task"]', ["task", "leave it out"]),
    ("reward = 2.0", "reward = -1.0", ["-1.0", ">= 0.0"]),
    ("reward = 2.0", "reward = nan", ["nan", "finite"]),
    ('currency = "USD"', 'currency = "dollars"', ["'dollars'", "[A-Z]{3}"]),
    ("consent = 1", "consent = -1", ["-1", "0 to 86400"]),
    ("consent = 1", "consent = 'long'", ["'long'", "0 to 86400"]),
    ("latency_ms = 500", "latency_ms = inf", ["inf", "finite"]),
    ("latency_ms = 500", "latency = 500", ["500", "latency_ms"]),
    ('platform = "link"', 'platform = "mturk"', ["'mturk'", "external-question, lab, link, prolific"]),
    ('platform = "link"', 'api_url = "ftp://x"', ["'ftp://x'", "https://HOST"]),
    ("idle = 60", "timed_out_after = 5", ["5", "abandoned_after"]),
]  # fmt: skip


def refusal(path, before, after):
    assert before in STUDY
    text = STUDY.replace(before, after, 1)
    path.write_text(text)
    with pytest.raises(ConfigError) as caught:
        check_study(path)
    return str(caught.value), next(
        n for n, line in enumerate(text.splitlines(), 1) if line in after.splitlines()
    )


@pytest.mark.parametrize(("before", "after", "parts"), FAULTS, ids=[after for _, after, _ in FAULTS])
def test_a_refusal_names_line_key_value_and_choices(tmp_path, monkeypatch, before, after, parts):
    monkeypatch.setattr("mjsim.house.scene.sampling.PACKINGS", 1)
    said, line = refusal(tmp_path / "study.toml", before, after)
    assert said.startswith(f"{tmp_path / 'study.toml'}, line {line}: ")
    assert [part for part in (after.partition(" ")[0], *parts) if part not in said] == [], said


def test_a_good_file_is_a_study_and_platforms_are_asked_for_when_people_are_recruited(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(STUDY)
    assert check_study(path, recruits=True).settings.name == "small"
    path.write_text(STUDY.replace('"link"', '"connect"'))
    assert check_study(path) is not None
    with pytest.raises(ConfigError, match=r"line 36: study.recruitment.completed is empty"):
        check_study(path, recruits=True)


HOMES = ("points = 40", 'houses = "generated:0:2?rooms=1"')


@pytest.mark.parametrize(
    ("before", "after", "part"),
    [
        ('"consent", "task"', '"consent", "flythrough", "task"', "phases has flythrough"),
        ("minutes = 10", "minutes = 10\nrequire_film = true", "require_film is true"),
        (
            "house_seeds = 57",
            'house_seeds = 57\nstory = "story.md"\nphases = "story,task"',
            "story has {Bins}",
        ),
    ],
)
def test_a_study_in_several_homes_has_neither_a_film_nor_a_story_with_the_bins(tmp_path, before, after, part):
    (tmp_path / "story.md").write_text("Bins: {Bins}.")
    text = STUDY.replace(*HOMES).replace(before, after).replace('["consent"', '["consent", "story"')
    (tmp_path / "study.toml").write_text(text)
    with pytest.raises(ConfigError, match=f"{re.escape(part)}.* 2( houses)?[:;]") as caught:
        check_study(tmp_path / "study.toml")
    assert re.search(r"study.toml, line \d+: ", str(caught.value))


@pytest.mark.slow
def test_the_check_of_a_study_looks_for_the_places_of_the_objects_in_all_homes(tmp_path):
    path, shown = tmp_path / "study.toml", []
    path.write_text(STUDY.replace(*HOMES).replace("objects = 1", "objects = 3"))
    check_homes(check_study(path), shown.append)
    assert len({*shown}) == 2
    path.write_text(path.read_text().replace("objects = 3", "objects = 40"))
    with pytest.raises(ConfigError, match=r"study.toml: generated:0\?rooms=1&version=\d+, house seed 57: "):
        check_homes(check_study(path), shown.append)


@pytest.mark.parametrize(
    ("command", "before", "after"),
    [
        ("check", '"none"', '"best"'),
        ("serve", '"guest"', '"nobody"'),
        ("simulate", "latency_ms = 500", "latency_ms = inf"),
        ("rehearse", "points = 40", 'house = "nohouse"'),
        ("preregister", '"consent", ', '"missing.module:Phase", '),
    ],
)
def test_all_commands_that_start_something_check_the_whole_file(tmp_path, capsys, command, before, after):
    path = tmp_path / "study.toml"
    path.write_text(STUDY.replace("[study.minimum]\nconsent = 1\n", "").replace(before, after, 1))
    out = [] if command == "check" else ["--out", str(tmp_path / "out")]
    assert main(["study", command, str(path), *out]) == 2
    assert f"{path}, line " in capsys.readouterr().err
    assert not (tmp_path / "out").exists(), "nothing was begun"
