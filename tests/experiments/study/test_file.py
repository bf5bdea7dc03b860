"""Files of studies with people: what they say, and errors that name the line."""

import re
from collections import Counter

import pytest
from starlette.datastructures import ImmutableMultiDict

from experiments.analysis.study.measures import read_measures
from experiments.cli.main import main
from experiments.errors import ConfigError
from experiments.study.file import PHASES, TEMPLATE, read_people_study
from experiments.study.plan import plan_of
from experiments.trials.designs import FOLDER
from experiments.visit.phases import phases_of
from experiments.visit.phases.base import Visitor
from experiments.visit.texts import FOLDER as TEXTS
from experiments.visit.texts import languages, read_texts

PAPER = FOLDER / "paper.toml"


def test_the_published_study_has_12_cells_of_447_people_and_all_phases():
    study = read_people_study(PAPER)
    assert (len(study.cells), study.people) == (12, 447)
    assert study.settings.phases == PHASES
    assert study.settings.pay.reward == 7.5
    trial = study.cells[3].trial(0)
    assert (trial.user, trial.live, trial.phase_names[-1]) == ("human", True, "task")
    orders = [cell.trial(place).order_seed for cell in study.cells for place in range(len(cell.trials))]
    assert len(set(orders)) == 447


def test_the_survey_asks_what_the_analysis_reads():
    survey = read_people_study(PAPER).texts["survey"]
    assert [item.name for item in survey.items if item.kind == "scale"] == list(read_measures().likert)
    assert len(survey.scale) == 5


@pytest.mark.parametrize(
    ("before", "after", "line", "value"),
    [
        ("reward = 7.50", 'reward = "much"', "reward", "study.pay.reward is 'much'"),
        ("reward = 7.50", "reward = 7.505", None, "reward is 7.505; amounts have at most two decimals"),
        ('currency = "USD"', 'currency = "USD\\n"', "currency", "study.pay.currency is 'USD\\n'"),
        ('title = "Tidying up with a helpful display"', 'title = " "', "title", "title is ' '"),
        ("reward = 7.50", "rewards = 7.50", "rewards", "`rewards`"),
        ("story = 20", "story = -1", "story", "minimum.story is -1"),
        ("minutes = 25", "minutes = 0", "minutes", "study.minutes is 0"),
        ('assignment = "uniform"', 'assignment = "fair"', "assignment", "'fair'"),
        ("minutes = 25", 'minutes = 25\nphases = ["task", "consent", "completion"]', None, "in the order"),
        ("minutes = 25", 'minutes = 25\nphases = ["consent", "completion"]', None, "needs the phase task"),
        ("minutes = 25", 'minutes = 25\noptional = ["consent"]', None, "optional names 'consent'"),
        ("minutes = 25", 'minutes = 25\nlanguage = "xx"', None, "no texts in language 'xx'"),
    ],
)
def test_errors_name_line_and_value(tmp_path, before, after, line, value):
    text = PAPER.read_text().replace(before, after, 1)
    path = tmp_path / "study.toml"
    path.write_text(text)
    with pytest.raises(ConfigError, match=re.escape(value)) as caught:
        read_people_study(path)
    if line is not None:
        key = line if line.startswith("\\[") else rf"^{line} ="
        number = next(i for i, row in enumerate(text.splitlines(), 1) if re.match(key, row) and i > 80)
        assert f"{path}, line {number}:" in str(caught.value)


def test_a_design_alone_is_no_study_with_people(tmp_path):
    path = tmp_path / "design.toml"
    path.write_text('[[cells]]\nobjects = 6\nassistance = "none"\npeople = 2\n')
    with pytest.raises(ConfigError, match="mjsim study init"):
        read_people_study(path)


def test_cells_share_what_is_one_for_all(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(PAPER.read_text().replace("[[cells]]\n", '[[cells]]\nhouse = "generated:0"\n', 1))
    with pytest.raises(ConfigError, match=r"cells differ in houses \(apartment, generated:0"):
        read_people_study(path)
    table = '[[cells]]\nassistance = "{}"\nobjects = 6\npeople = 2\nhouse = "{}"\n\n'
    tables = [
        table.format(assistance, house)
        for assistance in ("none", "optimal")
        for house in ("apartment", "generated:0")
    ]
    template = TEMPLATE.read_text()
    start, end = template.index("[[cells]]"), template.index("# ---- Exclusions")
    path.write_text(template[:start] + "".join(tables) + template[end:])
    with pytest.raises(ConfigError, match=r"cells differ in houses \(apartment, generated:0"):
        read_people_study(path)


PLACES = ("title", "institution", "contact", "minutes", "pay")
ITEM = '[[survey.item]]\nname = "{}"\nkind = "{}"\ntext = "?"\n'


def test_own_texts_replace_some_and_are_checked(tmp_path):
    values = {name: name for name in ("title", "institution", "contact", "minutes", "pay")}
    own = tmp_path / "texts.toml"
    own.write_text('[story]\ntitle = "Clean up for {contact}"\n')
    texts = read_texts("en", own, values)
    assert texts["story"]["title"] == "Clean up for contact"
    assert texts["survey"].items  # the others are the usual ones
    for content, complaint in [
        ('[stories]\ntitle = "x"\n', r"no section \[stories\]"),
        ('[story]\nheading = "x"\n', "no text 'heading'"),
        ('[story]\ntitle = "{nobody}"\n', r"place \{nobody\}"),
        ('[survey]\n[[survey.item]]\nname = "Q 1"\nkind = "text"\ntext = "?"\n', "survey"),
        (
            '[survey]\n[[survey.item]]\nname = "q"\nkind = "choice"\ntext = "?"\nchoices = ["a"]\n',
            "two choices",
        ),
    ]:
        own.write_text(content)
        with pytest.raises(ConfigError, match=complaint):
            read_texts("en", own, values)


@pytest.mark.parametrize(
    ("content", "line", "said"),
    [
        ('[story]\ntitle = "x"\n\n[stories]\ntitle = "x"\n', 4, r"no section \[stories\]"),
        ('[story]\ntitle = "x"\nheading = "x"\n', 3, "no text 'heading' in"),
        ('[welcome]\ntitle = "x"\n[story]\ntitle = 3\n', 4, "title is 3; write a text"),
        ('[story]\n[consent]\ntitle = "x"\ntext = """\nA {nobody}"""\n', 4, r"text has a place \{nobody\}"),
        (
            f"{ITEM.format('a', 'text')}{ITEM.format('b', 'essay')}",
            7,
            "item 2: kind is 'essay'; Invalid enum",
        ),
        (f"{ITEM.format('a', 'text')}{ITEM.format('a', 'line')}", 6, "two items with the name 'a'"),
        (f"{ITEM.format('a', 'text')}{ITEM.format('b', 'scale')}right = 9\n", 9, "right is 9, no point"),
    ],
)
def test_errors_of_ones_own_texts_name_line_and_value(tmp_path, content, line, said):
    own = tmp_path / "texts.toml"
    own.write_text(content)
    with pytest.raises(ConfigError, match=rf"^{re.escape(str(own))}, line {line}: .*{said}"):
        read_texts("en", own, {name: name for name in PLACES})


def shape(texts):
    """Keys, places and items of texts, without words."""
    return {
        name: (
            {key: {place.lower() for place in re.findall(r"{\w+}", words)} for key, words in section.words.items()},
            [
                (i.name, i.kind, len(i.choices), i.low, i.high, i.required, i.right and i.choices.index(i.right))
                for i in section.items
            ],
            len(section.scale),
        )
        for name, section in texts.items()
    }  # fmt: skip


def test_every_language_has_the_same_texts_places_and_items():
    assert languages() == ("de", "en")
    values = {name: f"{{{name}}}" for name in PLACES}
    german, english = (read_texts(language, None, values) for language in languages())
    assert shape(german) == shape(english)
    same = {
        f"{name}.{key}" for name, section in english.items() for key, words in section.words.items()
        if german[name].words[key] == words
    }  # fmt: skip
    international = {
        "trial.pause",
        "trial.action_pause",
        "trial.hand",
        "trial.gamepad",
        "trial.headset",
        "trial.normal",
    }
    assert same == {"welcome.title", *international}, "these words are not translated"


@pytest.mark.parametrize("language", languages())
def test_people_in_several_homes_have_no_film_and_a_story_of_any_home(tmp_path, language):
    path = tmp_path / "study.toml"
    assert main(["study", "init", str(path)]) == 0
    text = path.read_text().replace("[all_cells]", '[all_cells]\nhouses = "generated:0:3"')
    path.write_text(text.replace('language = "en"', f'language = "{language}"'))
    study = read_people_study(path)
    assert study.settings.phases == tuple(name for name in PHASES if name != "flythrough")
    assert "{" not in study.story and study.cells[0].trial(0).phase_names == ("story", "training", "task")
    for cell in study.cells:
        homes = Counter(trial.house for trial in cell.trials)
        assert sorted(homes.values()) == [6, 7, 7]
        assert [cell.trial(k).house for k in range(6)] == [*homes, *homes]


def test_a_study_in_another_language_has_its_story_and_its_messages(tmp_path):
    path = tmp_path / "study.toml"
    assert main(["study", "init", str(path)]) == 0
    path.write_text(path.read_text().replace('language = "en"', 'language = "de"'))
    study = read_people_study(path)
    assert "Ferienwohnung" in study.story and study.cells[0].trial(0).story.endswith("story.de.md")
    survey = next(phase for phase in phases_of(plan_of(study)) if phase.name == "survey")
    sent = ImmutableMultiDict({**survey.example(), "age": "7"})
    refused = survey.read(Visitor({}, 0.0, 0, "/"), sent)
    assert "zwischen 18 und 120" in refused.values["form"]["age"].errors[0]


@pytest.mark.parametrize("own", [None, "Meine eigene Geschichte."])
def test_the_comprehension_check_shows_the_story_of_the_language_also_without_a_story_phase(tmp_path, own):
    path = tmp_path / "study.toml"
    settings = 'language = "de"\nphases = ["comprehension", "task", "completion"]'
    text = TEMPLATE.read_text().replace("story = 20\nflythrough = 30", "")
    text = text.replace('language = "en"', settings)
    if own is not None:
        (tmp_path / "story.md").write_text(own)
        text = text.replace("[all_cells]", '[all_cells]\nstory = "story.md"\nphases = "story,task"')
    path.write_text(text)
    study = read_people_study(path)
    check = next(phase for phase in phases_of(plan_of(study)) if phase.name == "comprehension")
    shown = "\n".join(check.values(Visitor({}, 0.0, 0, "/"))["story"])
    assert (own or "Ferienwohnung") in shown
    assert study.cells[0].trial(0).phase_names == ("task",)


def test_a_language_of_ones_own_needs_all_texts_and_a_story(tmp_path):
    path = tmp_path / "study.toml"
    assert main(["study", "init", str(path)]) == 0
    usual = path.read_text().replace('language = "en"', 'language = "nl"')
    (tmp_path / "verhaal.md").write_text("Ruim alles op.")
    path.write_text(usual.replace("[all_cells]", '[all_cells]\nstory = "verhaal.md"\nphases = "story,task"'))
    with pytest.raises(ConfigError, match="name a file with all `texts`"):
        read_people_study(path)
    path.write_text(path.read_text().replace('# texts = "texts.toml"', 'texts = "texts.toml"'))
    german = (TEXTS / "de.toml").read_text()
    (tmp_path / "texts.toml").write_text(german.replace('next = "Weiter"\n', ""))
    with pytest.raises(ConfigError, match=r"\[common\] lacks 'next'"):
        read_people_study(path)
    (tmp_path / "texts.toml").write_text(german)
    told = path.read_text()
    path.write_text(told.replace('story = "verhaal.md"\n', ""))
    with pytest.raises(ConfigError, match="no story in language 'nl'"):
        read_people_study(path)
    path.write_text(told)
    assert read_people_study(path).story == "Ruim alles op."


def test_the_template_is_a_study(tmp_path, capsys):
    path = tmp_path / "study.toml"
    assert main(["study", "init", str(path)]) == 0
    study = read_people_study(path)
    assert (len(study.cells), study.people, study.settings.phases) == (2, 40, PHASES)
    assert main(["study", "init", str(path)]) == 2, "nothing is replaced"
    assert "--force" in capsys.readouterr().err
