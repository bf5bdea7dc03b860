"""The documents are true: their code and commands run, their tables list what there is, their links lead somewhere."""

import dataclasses
import doctest
import importlib
import json
import math
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import hud_sample as sample
import msgspec
import nbformat
import pytest
from example_house import write_example_house
from nbclient import NotebookClient
from planning_cases import random_problem
from starlette.datastructures import ImmutableMultiDict

from experiments.analysis.study.measures import FILE as MEASURES
from experiments.cli.main import main
from experiments.participants.base import Percept
from experiments.participants.distribution import Distributions
from experiments.participants.guest import PARAMETERS
from experiments.session.familiarise import STORY_FILE
from experiments.session.own_planner import planner_named
from experiments.study.file import TEMPLATE, read_people_study
from experiments.study.plan import plan_of
from experiments.trials.person import PARAMETERS as PERSON
from experiments.trials.person import check_person
from experiments.trials.trial import run_trial
from experiments.trials.trial_config import TrialConfig
from experiments.visit import Again, Phase, Visitor
from experiments.visit.phases import phases_of
from experiments.visit.server.admission import NEW_PEOPLE
from hud.conditions import CONDITIONS, OPTIONS, condition
from hud.task import TaskView
from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.values.person_parameters import RANGES
from tools.data_dictionary import data_dictionary

TESTS = Path(__file__).parents[1]
DOCS = TESTS.parent / "docs"
PAPER_LINKS = re.findall(
    r"`((?:\w+/)*test_\w+\.py)::(test_\w+)`", (DOCS / "paper.md").read_text(encoding="utf-8")
)


def page(name):
    return (DOCS / name).read_text(encoding="utf-8")


def blocks(name, language):
    """The code of a page."""
    return re.findall(rf"```{language}\n(.*?)```", page(name), re.DOTALL)


@pytest.mark.parametrize(
    "path", sorted([*DOCS.glob("*.md"), *TESTS.parent.glob("*.md")]), ids=lambda p: p.name
)
def test_links_within_the_documents_lead_to_files(path):
    for link in re.findall(r"\]\((?!https?:|mailto:|#)([^)#]+)", path.read_text(encoding="utf-8")):
        assert (path.parent / link).exists(), link


def test_the_data_dictionary_is_up_to_date():
    assert page("data.md") == data_dictionary(), "run `make data-dictionary`"


def test_the_hud_page_names_every_condition_and_option():
    assert all(f"`{name}`" in page("hud.md") for name in (*CONDITIONS, *OPTIONS))


@pytest.mark.parametrize("yaw", [0.0, 1.5, 3.1, -1.5])
def test_the_arrow_of_the_hud_page_points_to_the_next_object_only(own_module, yaw):
    (code,) = [c for c in blocks("hud.md", "python") if "def hud_state" in c]
    arrow = condition(f"{own_module(code, 'arrow_of_the_docs')}:hud_state")
    view = dataclasses.replace(sample.task(6), camera=sample.camera(640, 480, yaw=yaw))
    state = arrow(view)
    assert dataclasses.replace(state, pointer=None) == condition("none")(view) and state.markers == ()
    right, up, forward = (float(v) for v in view.camera.to_eye(view.goal))
    half = math.tan(view.camera.fovy / 2)
    inside = forward > 0 and abs(up) < half * forward and abs(right) < half * 640 / 480 * forward
    assert (state.pointer is None) is inside
    assert state.pointer is None or math.cos(state.pointer.angle) * right > 0
    bins = dataclasses.replace(sample.task(6, steps=2), camera=sample.camera(640, 480, yaw=3.0))
    assert bins.plan[0].kind == "place" and condition("guided")(bins).pointer is not None
    assert arrow(bins).pointer is None


@pytest.mark.slow
def test_the_example_of_the_import_page_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    for code in blocks("import.md", "python"):
        exec(compile(code, "docs/import.md", "exec"), {})
    for line in blocks("import.md", "sh")[0].splitlines():
        words = [*shlex.split(line)[1:], *(["--fidelity", "event"] if " run " in line else [])]
        assert main(words) == 0
    assert "toy_robot" in Catalogue.load("my-house/catalogue.toml").categories["toys"].objects
    assert "toy_robot" in Path("runs/robot/episode.json").read_text(encoding="utf-8")
    for row in json.loads(Path("my-house/toy_robot/report.json").read_text(encoding="utf-8")):
        cells = " | ".join((row["what"], row["choice"], row["reason"])).strip()
        assert f"| {cells} |" in page("import.md")


@pytest.mark.parametrize(
    "name",
    [
        "mjsim.environments.dm_environment",
        "mjsim.generator.home_cache",
        "mjsim.house.catalogue.catalogue",
        "mjsim.house.scene.sampling",
        "mjsim.values.person_parameters",
        "mjsim.world.world",
        "planner.geodesics",
        "planner.problem",
        "planner.solvers",
    ],
)
def test_examples_in_docstrings_are_true(name):
    found = doctest.testmod(importlib.import_module(name))
    assert found.attempted and not found.failed


@pytest.mark.slow
def test_the_tutorial_runs(tmp_path):
    notebook = nbformat.read(DOCS / "tutorial.ipynb", as_version=4)
    assert not any(cell.get("outputs") for cell in notebook.cells), "clear the outputs; the site makes them"
    for cell in notebook.cells:
        for link in re.findall(r"\]\(([\w-]+\.md)\)", cell.source):
            assert (DOCS / link).is_file(), link
    NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(tmp_path)}}).execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", ())]
    assert sum("image/png" in output.get("data", {}) for output in outputs) == 4
    printed = "".join(output.get("text", "") for output in outputs)
    walked, slow = (float(x) for x in re.search(r"([\d.]+) s, and ([\d.]+) s", printed).groups())
    assert walked + 12 < slow and "task_distance_m: -" in printed


@pytest.mark.slow
def test_the_participant_of_its_page_tidies_a_house_and_prefers_distant_objects(own_module, tmp_path):
    own = f"{own_module(blocks('participants.md', 'python')[0], 'own')}:build"
    config = TrialConfig(objects=3, assistance="highlight", seed=0, user=own, fidelity="event", regret=False)
    far = run_trial(config, tmp_path / "far", topdown=False)
    near = run_trial(msgspec.structs.replace(config, user="nearest"), tmp_path / "near", topdown=False)
    assert far["delivered"] == near["delivered"] == 3
    assert far["task_distance_m"] > near["task_distance_m"]


def test_the_planner_of_its_page_beats_the_nearest_first(own_module, tmp_path, house):
    name = f"{own_module(blocks('planners.md', 'python')[0], 'rollout_of_the_docs')}:Rollout"
    problem = random_problem(3, 8)
    own, greedy, exact = (planner_named(known).solve(problem).cost for known in (name, "greedy", "exact"))
    assert exact <= own < greedy
    config = TrialConfig(objects=3, assistance="optimal", seed=0, planner=name, fidelity="event")
    assert run_trial(config, tmp_path / "run", topdown=False, house=house)["delivered"] == 3


def short(number):
    return f"{float(f'{number:.4g}'):g}"


def in_words(usual):
    if isinstance(usual, float):
        return short(usual)
    ((kind, numbers),) = usual.items()
    if kind == "mixture":
        return ", ".join(
            f"{weight:g}: {part if isinstance(part, float) else in_words(part)}" for weight, part in numbers
        )
    return f"{kind} {numbers}"


@pytest.mark.parametrize(
    ("name", "parameters"),
    [("participants.md", PARAMETERS), ("participants.md", {name: PERSON[name] for name in RANGES})],
)
def test_the_table_of_a_page_lists_every_parameter_with_its_default_and_range(name, parameters):
    for key, parameter in parameters.items():
        (row,) = [line for line in page(name).splitlines() if line.startswith(f"| `{key}` |")]
        bounds = f"{short(parameter.lowest)} to {short(parameter.highest)}"
        assert f"| {in_words(parameter.usual)} | {bounds} | {parameter.unit} |" in row


def test_the_study_page_names_the_limit_of_new_participants():
    count, period = NEW_PEOPLE
    assert period == 60.0
    assert f"From one IP address, {count} new participants can begin per minute." in page("study.md")


def test_the_examples_of_the_pages_describe_behaviour_and_people():
    behaviour = Distributions.of(tomllib.loads(blocks("participants.md", "toml")[1])["cells"][0]["behaviour"])
    people = Distributions.of(tomllib.loads(blocks("participants.md", "toml")[0]))
    assert (len(behaviour), len(people)) == (2, 5)
    assert behaviour.keys() <= PARAMETERS.keys()
    check_person(people)


@pytest.mark.slow
def test_every_command_of_the_page_on_houses_works(tmp_path, monkeypatch, capsys):
    write_example_house(tmp_path / "my_house")
    monkeypatch.chdir(tmp_path)
    for line in "".join(blocks("build-a-house.md", "sh")).splitlines():
        command = shlex.split(line)[1:]
        assert main(command) == 0, line
        said = capsys.readouterr().out
        if command[0] == "check":
            assert "0 errors, 1 warning\n" in said and "--points" in said
        if command[0] == "run":
            metrics = json.loads(Path(command[-1], "metrics.json").read_text(encoding="utf-8"))
            assert metrics["delivered"] == metrics["objects"] == 4


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('"4 2 2.3"', '"4 2 2.3" ', None),
        ('mount:crate" pos="0.4 3.6 0"', 'mount:crate" pos="0.4 3.6 3"', "above the floor"),
        (
            '<geom name="lintel"',
            '<body name="door" pos="4 2 1"><joint name="hinge"/><geom size=".4 .02 1"/></body><geom name="lintel"',
            "'hinge'",
        ),
    ],
)
def test_the_faults_of_the_page_on_houses_are_reported(old, new, told, tmp_path, capsys):
    write_example_house(tmp_path)
    house = tmp_path / "house.xml"
    text = house.read_text(encoding="utf-8")
    assert old in text
    house.write_text(text.replace(old, new), encoding="utf-8")
    assert main(["check", str(tmp_path), "--json"]) == (2 if told else 0)
    assert told is None or told in capsys.readouterr().out


def test_every_sentence_of_the_paper_page_leads_to_a_test_that_exists():
    assert len(PAPER_LINKS) > 50
    for file, name in PAPER_LINKS:
        assert f"\ndef {name}(" in (TESTS / file).read_text(encoding="utf-8"), f"{file}::{name}"


def test_every_test_of_a_section_of_the_paper_is_named_by_its_page():
    written = {
        (f"paper/{path.name}", name)
        for path in (TESTS / "paper").glob("test_section_*.py")
        for name in re.findall(r"^def (test_\w+)\(", path.read_text(encoding="utf-8"), re.MULTILINE)
    }
    assert written <= set(PAPER_LINKS)
    assert all(line.count("|") == 3 for line in page("paper.md").splitlines() if "::test_" in line)


def test_what_the_paper_page_says_of_departures_is_so(capsys):
    text, items = page("paper.md"), tomllib.loads(MEASURES.read_text(encoding="utf-8"))["likert"]
    assert len(items) == 17 and "names the 17 items" in text
    for file in (STORY_FILE, MEASURES):
        assert f"`{file.relative_to(TESTS.parent)}`" in text
    limit = TrialConfig(objects=6, assistance="none", seed=0).limit
    assert limit == 60.0 + 6 * 150.0 and "after 60 s and 150 s for each object" in text
    with pytest.raises(SystemExit):
        main(["play", "--help"])
    told = capsys.readouterr().out
    for option in ("--story", "--film", "--phases", "--time-limit"):
        assert option in text and option in told


@pytest.mark.slow
def test_the_site_has_every_public_name(tmp_path):
    """The tutorial is shown without its outputs here; `make site` runs it."""
    text, root = (DOCS.parent / "mkdocs.yml").read_text(encoding="utf-8"), DOCS.parent
    for old, new in {
        "execute: true": "execute: false",
        "docs_dir: docs": f"docs_dir: {DOCS}",
        "hooks: [tools": f"hooks: [{root}/tools",
        "paths: [.]": f"paths: [{root}]",
    }.items():
        assert old in text
        text = text.replace(old, new)
    (tmp_path / "mkdocs.yml").write_text(text, encoding="utf-8")
    build = [sys.executable, "-m", "mkdocs", "build", "--quiet", "--strict"]
    subprocess.run([*build, "--config-file", str(tmp_path / "mkdocs.yml")], cwd=root, check=True)
    site = (tmp_path / "site" / "api" / "index.html").read_text(encoding="utf-8")
    modules = re.findall(r"^::: (\S+)$", page("api.md"), re.MULTILINE)
    paths = [f"{module}.{name}" for module in modules for name in importlib.import_module(module).__all__]
    assert [path for path in paths if f'id="{path}"' not in site] == []


def test_the_example_of_the_api_page_walks():
    (code,), names = blocks("api.md", "python"), {}
    exec(compile(code, "docs/api.md", "exec"), names)
    start, position = names["episode"].start, names["step"].observation.position
    assert 0 < math.dist((start.x, start.y), position[:2]) < 0.1


def fields_in_table(name, head):
    """Names in the first column of the table that follows a sentence."""
    table = page(name).split(head, 1)[1].split("\n\n")[1]
    cells = [line.split("|")[1] for line in table.splitlines()[2:]]
    return {re.sub(r"\(.*\)", "", field) for cell in cells for field in re.findall(r"`([^`]+)`", cell)}


def public(kind):
    own = {
        name for name in (*vars(kind), *getattr(kind, "__dataclass_fields__", {})) if not name.startswith("_")
    }
    return own | {name for name in vars(kind).get("__annotations__", {}) if not name.startswith("_")}


def test_the_tables_of_fields_are_complete():
    by_init = {
        "time",
        "position",
        "heading",
        "pitch",
        "hands",
        "hands_full",
        "busy",
        "targets",
        "answer",
        "blocked",
    }
    percept = fields_in_table("participants.md", "A `Percept` has the following fields")
    assert percept == public(Percept) | by_init | {"person"}
    assert fields_in_table("hud.md", "A `TaskView` contains everything") == public(TaskView)
    assert fields_in_table("study-file.md", "For a page of another kind") == public(Phase) | {"example"}
    assert all(f"`{name}`" in page("study-file.md") for name in public(Visitor))


def test_the_phase_of_the_study_file_page_runs_from_its_texts(tmp_path, monkeypatch):
    """Class, line of the study file, and texts, as printed."""
    [code] = [block for block in blocks("study-file.md", "python") if "FormPhase" in block]
    *_, phases, texts = blocks("study-file.md", "toml")
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "mood.py").write_text(code)
    (tmp_path / "my_texts.toml").write_text(texts)
    (tmp_path / "study.toml").write_text(re.sub("# texts = .*", phases, TEMPLATE.read_text()))
    plan = plan_of(read_people_study(tmp_path / "study.toml"))
    [mood] = [phase for phase in phases_of(plan) if phase.name == "mood:Mood"]
    page = mood.page(Visitor({}, 0.0, 0, "/play/x"))
    assert page.template == "form" and page.values["section"]["title"] == "Your mood"
    assert isinstance(mood.read(Visitor({}, 0.0, 0, "/play/x"), ImmutableMultiDict()), Again)
    assert mood.read(Visitor({}, 0.0, 0, "/play/x"), ImmutableMultiDict(calm="2")).answers == {"calm": 2}
