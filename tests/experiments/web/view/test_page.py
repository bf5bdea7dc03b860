"""The file of `mjsim view` holds all that it needs."""

import base64
import gzip
import json
import re
import shutil

import pytest

from experiments.cli.main import main
from experiments.trials.trial import run_trial
from experiments.trials.trial_config import TrialConfig
from experiments.web.client_files import STATIC


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("page") / "run"
    run_trial(TrialConfig(objects=1, assistance="none", seed=1, fidelity="event"), folder, topdown=False)
    return folder


@pytest.fixture(scope="module")
def page(run, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "run.html"
    assert main(["view", str(run), "--out", str(path)]) == 0
    return path.read_text("utf-8")


def packed(page, name):
    content = re.search(rf'id="{name}">([^<]*)<', page)[1]
    return json.loads(gzip.decompress(base64.b64decode(content)))


@pytest.mark.slow
def test_every_module_that_is_imported_is_in_the_page(page):
    modules = json.loads(re.search(r'<script type="importmap">(.*?)</script>', page)[1])["imports"]
    assert {"view/view.js", "vendor/three.js", "hud.js"} <= modules.keys()
    for name, address in modules.items():
        source = base64.b64decode(address.partition(",")[2]).decode()
        needed = re.findall(r'^(?:import|\} from|import .* from)\s*"([^"]+)";', source, re.MULTILINE)
        assert set(needed) <= modules.keys(), name
        assert len(source) > 0.9 * len((STATIC / name).read_text("utf-8"))


def test_only_the_models_of_the_run_are_in_the_page(page):
    files, run = packed(page, "scene-data"), packed(page, "run-data")
    (model,) = run["models"].values()
    assert [name for name in files if name.startswith("objects/")] == [f"objects/{model}.glb"]
    assert {"scene.json", "house.glb", "person.glb"} <= files.keys()
    assert all(address.startswith("data:") for address in files.values())
    assert len(page) < 4e6


def test_nothing_is_asked_from_elsewhere(page):
    plain = re.sub(r"data:[^\"')]*", "", page)
    assert not re.search(r"(?:src|href)=\"(?!data:)[^\"]", plain)
    # The style sheet names one picture, which browsers load only for an element that this page does not have.
    rules = [rule.rpartition("}")[2].partition("{")[0].strip() for rule in plain.split("url(")[:-1]]
    assert rules == [".sheet .view"]
    assert 'class="view"' not in plain


@pytest.mark.parametrize(
    ("out", "says"), [("run.txt", "name a file that ends in .html"), ("old.html", "replace it with --force")]
)
def test_a_file_that_cannot_be_written_is_refused_first(run, tmp_path, capsys, out, says):
    (tmp_path / "old.html").write_text("mine")
    assert main(["view", str(run), "--out", str(tmp_path / out)]) == 2
    assert says in capsys.readouterr().err
    assert (tmp_path / "old.html").read_text() == "mine"


def test_a_run_without_metrics_has_no_bad_step(run, tmp_path, capsys):
    copy = shutil.copytree(run, tmp_path / "copy")
    (copy / "metrics.json").unlink()
    assert main(["view", str(copy), "--out", str(tmp_path / "run.html")]) == 1
    said = capsys.readouterr().err
    assert "no step differs, but a file does: metrics.json is missing" in said and "bad step" not in said
    assert f"`mjsim metrics {copy}` computes the metrics again" in said
    assert main(["metrics", str(copy)]) == 0, "what the message offers"


def test_a_changed_run_is_not_shown(run, tmp_path, capsys):
    copy = shutil.copytree(run, tmp_path / "copy")
    log = (copy / "events.jsonl").read_text()
    (copy / "events.jsonl").write_text(log.replace('"kind": "pick"', '"kind": "place"'))
    assert main(["view", str(copy), "--out", str(tmp_path / "run.html")]) == 1
    assert "first bad step" in capsys.readouterr().err
    assert not (tmp_path / "run.html").exists()
