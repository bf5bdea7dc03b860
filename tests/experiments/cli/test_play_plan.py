"""The plan of `mjsim play`: its questions and its phases."""

import subprocess
import sys

import pytest
from play_site import arguments_of

from experiments.cli.play import questions_of, shown_phases, task_of
from experiments.cli.play_plan import plan_of_play
from experiments.errors import ConfigError

GOOD = '[[question]]\ntext = "How many?"\nchoices = ["one", "two"]\nanswer = "two"\n'


def plan(*words):
    arguments = arguments_of(*words)
    return plan_of_play(arguments, task_of(arguments), shown_phases(arguments), questions_of(arguments))


def test_questions_are_asked_in_order_after_the_story(tmp_path):
    path = tmp_path / "questions.toml"
    path.write_text(GOOD + GOOD.replace("How many?", "Why?"))
    made = plan("--questions", str(path))
    assert made.phases == ("story", "comprehension", "training", "task", "result")
    items = made.texts["comprehension"].items
    assert [(item.text, item.right) for item in items] == [("How many?", "two"), ("Why?", "two")]


@pytest.mark.parametrize(
    "text",
    [
        "",
        "x = [",
        GOOD.replace('answer = "two"', 'answer = "three"'),
        GOOD.replace('["one", "two"]', '["two"]'),
        GOOD.replace('["one", "two"]', '["two", "two", "one"]'),
        GOOD.replace("answer", "anwser"),
        "question = []",
        "question = 3",
    ],
)
def test_questions_that_cannot_be_asked_are_refused(tmp_path, text):
    path = tmp_path / "questions.toml"
    path.write_text(text)
    with pytest.raises(ConfigError, match="has no valid questions"):
        plan("--questions", str(path))


@pytest.mark.parametrize(
    "words", [("--minimum", "flythrough=3"), ("--minimum", "story=3", "--phases", "task")]
)
def test_a_time_for_a_phase_that_is_not_shown_is_refused(words):
    with pytest.raises(ConfigError, match="which is not shown"):
        plan(*words)


def test_every_visit_has_seeds_that_tables_can_hold():
    made = plan("--seed", str(2**63 - 1))
    place = type("Place", (), {"person_id": 7, "house_seed": 2**63})
    settings = made.trials(place)["task"]
    assert settings["order_seed"] == 5 and settings["house_seed"] == 0


@pytest.mark.slow
def test_play_needs_no_extra():
    missing = "argon2", "httpx", "prometheus_client", "aiomysql", "psycopg", "matplotlib", "statsmodels"
    code = f"import sys; sys.modules |= dict.fromkeys({missing}); import experiments.cli.play_plan, "
    code += "experiments.visit.server.app, experiments.visit.store"
    subprocess.run([sys.executable, "-c", code], check=True)
