"""Questions about the story, read from TOML."""

import pytest

from experiments.errors import ConfigError
from experiments.procedure.comprehension import read_questions

GOOD = '[[question]]\ntext = "How many?"\nchoices = ["one", "two"]\nanswer = "two"\n'


def test_questions_are_read_in_order(tmp_path):
    path = tmp_path / "questions.toml"
    path.write_text(GOOD + GOOD.replace("How many?", "Why?"))
    assert [(question.text, question.answer) for question in read_questions(path)] == [
        ("How many?", "two"),
        ("Why?", "two"),
    ]


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
    ],
)
def test_what_cannot_be_asked_is_refused(tmp_path, text):
    path = tmp_path / "questions.toml"
    path.write_text(text)
    with pytest.raises(ConfigError, match="has no questions"):
        read_questions(path)
