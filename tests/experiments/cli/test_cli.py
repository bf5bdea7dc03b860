"""The command line teaches, and names what is wrong with what it was given."""

import argparse
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import mujoco
import pytest
from glb_files import File

from experiments.cli.main import COMMANDS, main, parser
from experiments.cli.options import frame_size, int_list, seconds, text_list
from mjsim.values.episode import Episode

ROOT = Path(__file__).parents[3]
PLAY = ["play", "--no-open", "--port", "0"]
DESIGN = str(ROOT / "docs" / "designs" / "two_houses.toml")
DEFAULTS = {  # some that the help of a command names
    "run": ["objects, 1 to --points (default: 6)", "(default: optimal)", "size in pixels (default: 960x540)"],
    "batch": ["(default: 0:10)", "(default: none,highlight,optimal)", "(default: apartment)"],
    "play": ["(default: story,flythrough,training,task)"],
    "replay": [
        "seconds (default: 0)",
        "(default: first-person)",
        "a free camera, in metres (default: circles",
    ],
}


@pytest.mark.parametrize(
    ("read", "text", "value"),
    [
        (int_list, "7,0:2", [7, 0, 1]),
        (text_list, "none, optimal,", ["none", "optimal"]),
        (frame_size, "1920x1080", (1920, 1080)),
        (seconds, "0", 0.0),
    ],
)
def test_values_of_options(read, text, value):
    assert read(text) == value


@pytest.mark.parametrize(
    ("read", "texts"),
    [
        (int_list, ["", "a", "1:b", "3:3", "-1", "1;2"]),
        (frame_size, ["640", "641x480", "8x8", "axb", "640x480x3"]),
        (seconds, ["nan", "inf", "-1", "soon"]),
    ],
)
def test_values_that_are_none(read, texts):
    for text in texts:
        with pytest.raises(argparse.ArgumentTypeError, match=re.escape(text) or None):
            read(text)


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_explains_itself_and_its_defaults(command, capsys):
    with pytest.raises(SystemExit) as stop:
        main([command, "--help"])
    assert stop.value.code == 0
    lines = capsys.readouterr().out.splitlines()
    text = " ".join(word for line in lines for word in line.split())
    assert len(lines) > 5 and "None" not in text and "False" not in text
    assert all(default in text for default in DEFAULTS.get(command, []))


def test_the_overview_names_every_command():
    text = parser().format_help()
    assert all(re.search(rf"\n    {command}\s", text) for command in COMMANDS)


@pytest.mark.parametrize(
    ("arguments", "fault"),
    [
        (["run", "--objects", "0", "--no-video"], "objects is 0"),
        (["run", "--user", "ghost", "--no-video"], "no participant 'ghost'"),
        (["run", "--planner", "oracle", "--no-video"], "unknown solver 'oracle'"),
        (["run", "--house", "castle", "--no-video"], "no house 'castle'"),
        (["run", "--profile", "sepia"], "no render profile 'sepia'"),
        (["run", "--profile", "ultra", "--no-video"], "no render profile 'ultra'"),
        (["run", "--user", "x" * 100_000, "--no-video"], "x ... "),
        (["house"], "name a file that ends in .xml (MJCF, for MuJoCo) or .glb (glTF)"),
        ([*PLAY, "--user", "follower"], "belongs to `mjsim run`"),
        ([*PLAY, "--assistance", "nonsense"], "no assistance condition"),
        ([*PLAY, "--objects", "0"], "objects is 0"),
        ([*PLAY, "--film", "nothing.mp4"], "film nothing.mp4 does not exist"),
        ([*PLAY, "--film", DESIGN], "is not an MP4 video"),
        ([*PLAY, "--public-url", "http://a:99999"], "must be of the form"),
        ([*PLAY, "--house", "castle"], "no house 'castle'"),
        ([*PLAY, "--public-url", "ftp://x"], "must be of the form"),
        ([*PLAY, "--public-url", "http://[::1"], "must be of the form"),
        ([*PLAY, "--minimum", "flythrough=60"], "refers to the phase flythrough, which is not shown"),
        (
            [*PLAY, "--phases", "task", "--questions", "q.toml"],
            "refers to the phase story, which is not shown",
        ),
        ([*PLAY, "--questions", "nothing.toml"], "cannot read the questions nothing.toml"),
        ([*PLAY, "--host", "no.such.host.invalid"], "choose another --port (0 for any) or --host"),
        (["batch", DESIGN, "--user", "searcher", "--seeds", "1"], "sets --seeds, --user; leave them out"),
        (["batch", "--seeds", "1,1"], "--seeds has a value twice"),
        (["batch", "--seeds", "0", "--workers", "0"], "at least one worker, got 0"),
        (["batch", "--assistance", ","], "at least one value for --assistance"),
    ],
)
def test_bad_input_is_named_in_one_line_and_leaves_nothing(arguments, fault, tmp_path, capsys):
    code = 1 if "--host" in arguments else 2
    assert main([*arguments, "--out", str(tmp_path / "out")]) == code
    message = capsys.readouterr().err.strip().splitlines()[-1]
    assert message.startswith("mjsim: ")
    assert fault in message and len(message) < 700
    assert not (tmp_path / "out").exists()


def test_a_film_in_an_unknown_language_is_refused(tmp_path, capsys):
    film = tmp_path / "film.mp4"
    assert main(["flythrough", "--language", "xx", "--out", str(film)]) == 2
    assert "no labels in language 'xx'; write labels.xx.toml" in capsys.readouterr().err and not film.exists()


@pytest.mark.parametrize(
    ("words", "fault"),
    [
        ("--objects 5 generate", "--objects has no effect before generate"),
        ("--house generated:7 export", "--house has no effect before export"),
        ("generate --objects 5", "unrecognized arguments: --objects 5"),
        ("generate --house apartment", "unrecognized arguments: --house apartment"),
        ("gallery apartment --seed 1", "unrecognized arguments: --seed 1"),
        ("export --rooms 3", "unrecognized arguments: --rooms 3"),
        ("export --episodes 0", "'0' is not a number from 1 to"),
        ("gallery apartment --workers 0", "'0' is not a number from 1 to"),
        ("gallery", "SOURCE"),
        ("castle", "invalid choice: 'castle'"),
    ],
)
def test_each_command_of_house_has_its_own_options(words, fault, tmp_path, capsys):
    with pytest.raises(SystemExit) as stop:
        main(["house", *words.split(), "--out", str(tmp_path / "out")])
    assert stop.value.code == 2 and fault in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("option", ["--objects", "--points", "--seed", "--episodes"])
def test_a_floor_plan_has_no_objects(option, tmp_path, capsys):
    out = tmp_path / "plan.json"
    assert main(["house", "export", "--format", "procthor", option, "1", "--out", str(out)]) == 2
    assert f"{option} has no effect with --format procthor" in capsys.readouterr().err
    assert not out.exists()


def test_both_formats_of_one_house_may_be_written_next_to_each_other(tmp_path, small_house, capsys):
    """The commands of docs/import.md: both write the same episode file, but none replaces another one."""
    words = ["house", "--house", str(small_house), "--objects", "2", "--points", "4", "--out"]
    assert main([*words, str(tmp_path / "house.xml")]) == 0
    assert main([*words, str(tmp_path / "house.glb")]) == 0
    (tmp_path / "house.glb").unlink()
    assert main([*words, str(tmp_path / "house.glb"), "--seed", "1"]) == 2
    assert "house.episode.json exists" in capsys.readouterr().err
    assert not (tmp_path / "house.glb").exists()


def test_a_house_for_stock_mujoco(tmp_path, capsys):
    assert main(["house", "--objects", "12", "--seed", "3", "--out", str(tmp_path / "house.xml")]) == 0
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "house.xml"))
    episode = Episode.load(tmp_path / "house.episode.json")
    for placed in episode.objects:
        address = model.joint(f"{placed.name}/free").qposadr[0]
        assert model.qpos0[address : address + 3] == pytest.approx(placed.position)
    assert f"{len(episode.objects)} misplaced objects" in capsys.readouterr().out


def test_a_house_for_other_programs(tmp_path, small_house, capsys):
    words = ["house", "--house", str(small_house), "--objects", "3", "--points", "4", "--seed", "3"]
    assert main([*words, "--out", str(tmp_path / "house.glb")]) == 0
    names = {node["name"] for node in File((tmp_path / "house.glb").read_bytes()).gltf["nodes"]}
    episode = Episode.load(tmp_path / "house.episode.json")
    assert {placed.name for placed in episode.objects} <= names
    assert "3 misplaced objects" in capsys.readouterr().out
    assert sorted(path.name for path in tmp_path.iterdir()) == ["house.episode.json", "house.glb"]


def test_regrets_that_nobody_worked_out_are_unknown(tmp_path, capsys):
    words = [
        "run",
        "--objects",
        "1",
        "--fidelity",
        "event",
        "--no-regret",
        "--no-video",
        "--no-floor-plan",
        "--time-limit",
        "1",
        "--out",
    ]
    assert main([*words, str(tmp_path / "out")]) == 0
    said = {" ".join(line.split()) for line in capsys.readouterr().err.splitlines()}
    assert {"visits with regret unknown", "total regret unknown"} <= said


def test_a_study_that_holds_more_people_than_asked_for_says_so(tmp_path, capsys, monkeypatch):
    (tmp_path / "study.toml").write_text(
        "[[cells]]\nobjects = 2\nassistance = 'none'\npeople = 3\nuser = 'guest'"
    )
    monkeypatch.setattr("experiments.cli.study.simulate.run_with_progress", lambda *_: ([{}] * 5, 0))
    assert main(["study", "simulate", str(tmp_path / "study.toml"), "--out", str(tmp_path / "out")]) == 0
    assert "has 2 more rows than the 3 asked for" in " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize(("command", "phases"), [("run", "task"), ("play", "story,flythrough,training,task")])
def test_the_help_names_the_phases_that_are_usual(command, phases, capsys):
    with pytest.raises(SystemExit):
        main([command, "--help"])
    text = " ".join(capsys.readouterr().out.split())
    assert f"(docs/trials.md) (default: {phases})" in text


async def _nothing(*_, **__):
    """Serves nobody."""


@pytest.mark.parametrize(("text", "code"), [("Once upon a time.", 0), (None, 2)])
def test_people_read_a_story_of_ones_own(text, code, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("experiments.web.server.pool.WorkerPool.warm_up", lambda _: None)
    monkeypatch.setattr("uvicorn.Server.serve", _nothing)
    story = tmp_path / "story.txt"
    if text is not None:
        story.write_text(text)
    words = ["play", "--port", "0", "--no-open", "--out", str(tmp_path / "out"), "--story", str(story)]
    assert main(words) == code
    assert ("cannot read the story" in capsys.readouterr().err) == bool(code)


def test_the_doctor_names_the_renderer(capsys):
    assert main(["doctor"]) == 0
    text = capsys.readouterr().out
    assert "OpenGL" in text
    assert "mujoco" in text


def test_the_version_is_told(capsys):
    with pytest.raises(SystemExit) as stop:
        main(["--version"])
    assert stop.value.code == 0
    assert capsys.readouterr().out.startswith("mjsim ")


@pytest.mark.slow
def test_modules_in_the_current_folder_are_found(tmp_path):
    """By the installed command, whose own folder is elsewhere: participant and planner of one's own."""
    (tmp_path / "mine.py").write_text(
        "from experiments.participants.searcher import build\nfrom planner.greedy_solver import GreedySolver\n"
    )
    words = "run --objects 1 --assistance none --fidelity event --time-limit 1 --no-video"
    own = "--user mine:build --planner mine:GreedySolver --out run"
    subprocess.run(
        [sys.executable, "-P", "-m", "mjsim", *words.split(), *own.split()],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        check=True,
        capture_output=True,
        timeout=120,
    )
    start = json.loads((tmp_path / "run/events.jsonl").read_text().splitlines()[0])
    assert (start["user"], start["planner"]) == ("mine:build", "mine:GreedySolver")
    assert len(start["inputs"]["module mine"]) == 16


def test_help_loads_nothing_of_the_simulator():
    """Start-up is most of the time of `--help`."""
    code = """import sys
from experiments.cli.main import main
for words in ([], ["run"], ["batch"], ["play"], ["study"], ["study", "score"]):
    try:
        main([*words, "--help"])
    except SystemExit:
        loaded = {"numpy", "mujoco", "numba", "scipy", "rich"} & set(sys.modules)
        print(words, loaded or "nothing", file=sys.stderr)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    said = done.stderr.splitlines()
    assert len(said) == 6 and all(line.endswith("] nothing") for line in said), said


def test_a_command_without_its_extra_names_it(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    assert main(["study", "analyze", str(tmp_path)]) == 2
    assert "pip install 'mjsim[study]'" in capsys.readouterr().err


def test_a_command_outside_its_checkout_says_what_it_needs(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "tools", None)
    monkeypatch.delitem(sys.modules, "tools.gallery_command", raising=False)
    assert main(["gallery", "--out", "pictures"]) == 2
    assert "needs the source checkout" in capsys.readouterr().err


def test_warnings_of_libraries_stay_off_the_terminal():
    code = """import sys, numpy; sys.argv[1:] = ['plan', 'nowhere.json']
from experiments.cli.main import main
main()
numpy.ones(1) / numpy.zeros(1)"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "nowhere.json" in done.stderr and "Warning" not in done.stderr


@pytest.mark.parametrize(
    ("words", "fault"),
    [
        ([*PLAY, "--host", " "], "is empty; name an address"),
        (["study", "serve", "s.toml", "--out", "x", "--researcher-host", " "], "is empty; name an address"),
        ([*PLAY, "--host", ""], "an argument is empty"),
        (["metrics", ""], "an argument is empty"),
        (["batch", "--out", "x", "--workers", "9" * 14], "is not a number from 0 to 100000"),
        (["replay", "run", "--assistance="], "an argument is empty"),
        ([*PLAY, "--language", "xx"], "invalid choice: 'xx'"),
        ([*PLAY, "--minimum", "story=1e99"], "1e+99 s is too long; give at most 86400 s"),
    ],
)
def test_values_that_mean_nothing_are_refused(words, fault, capsys):
    with pytest.raises(SystemExit) as stop:
        main(words)
    assert stop.value.code == 2 and fault in capsys.readouterr().err
