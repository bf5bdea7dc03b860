"""`mjsim check` recognises what it is given, lists all findings, draws them and says whether it can be used."""

import json

import cv2
import numpy as np
import pytest

from experiments.analysis.check_picture import draw_check
from experiments.cli.main import main
from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.catalogue.house_ref import models_root
from mjsim.house.check import CheckReport
from mjsim.house.scene.sampling import sample_episode
from mjsim.house.validation.findings import Finding

MUG = models_root() / "objects" / "mug.xml"


def report(path, capsys, *more):
    code = main(["check", str(path), "--json", *more])
    return code, json.loads(capsys.readouterr().out)


def test_kinds_are_recognised(small_house, small_catalogue, tmp_path, capsys):
    sample_episode(small_catalogue, objects=2, seed=0, points=4).save(tmp_path / "episode.json")
    cases = [
        (small_house, "house"),
        (small_house / "catalogue.toml", "house"),
        (small_house / "house.xml", "house"),
        (small_house / "crate.xml", "receptacle"),
        (small_house / "cube.xml", "object"),
        (MUG, "object"),
        (tmp_path / "episode.json", "episode"),
    ]
    for path, kind in cases:
        code, told = report(path, capsys)
        assert (code, told["kind"], told["usable"]) == (0, kind, True), told


@pytest.mark.parametrize("path", ["nowhere.xml", "castle", ".", "picture.png"])
def test_what_is_none_of_these_is_named_in_one_line(path, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["check", path]) == 2
    said = capsys.readouterr()
    assert len((said.err or said.out).strip()) > 20


def test_all_findings_are_listed_and_drawn(fresh_house, tmp_path, capsys):
    house = fresh_house.with_name("house.xml")
    door = '<body name="door"><joint name="hinge"/><geom size="1"/></body>'
    house.write_text(house.read_text().replace("</worldbody>", f"{door}</worldbody>"))
    ball = fresh_house.with_name("ball.xml")
    ball.write_text(ball.read_text().replace('mass="0.1"', 'mass="1000"').replace("0 0 0.12", "5 0 0.12"))
    picture = tmp_path / "faults.png"
    code, told = report(fresh_house, capsys, "--picture", str(picture))
    rules = {finding["rule"] for finding in told["findings"]}
    assert code == 2 and rules >= {"joints", "mass", "grips"}
    image = cv2.imread(str(picture))
    assert image is not None and image.shape[0] > 300 and image.std() > 5
    assert main(["check", str(fresh_house)]) == 2
    text = capsys.readouterr().out
    assert "hinge" in text and "cannot be used: 4 errors" in text
    assert main(["run", "--house", str(fresh_house), "--no-video", "--out", str(tmp_path / "run")]) == 2
    said = capsys.readouterr().err.strip().splitlines()[-1]
    assert "'hinge'" in said and "3 more; `mjsim check` lists them" in said
    assert not (tmp_path / "run").exists()


@pytest.mark.slow
def test_a_picture_cuts_no_finding_off(tmp_path):
    findings = tuple(
        Finding("groups", "house", f"{n} {'W' * 70} {'x' * 400}", "use group 0") for n in range(12)
    )
    heights = []
    for count in (1, 12):
        draw_check(tmp_path / "faults.png", CheckReport("house", "own", findings[:count]))
        image = cv2.imread(str(tmp_path / "faults.png"))
        heights.append(image.shape[0])
        assert (image[:, -15:] == 255).all() and (image[-10:] == 255).all()
    lines = np.flatnonzero((image[heights[0] - 100 :] < 128).any(axis=(1, 2)))
    assert np.count_nonzero(np.diff(lines) > 1) > 11 * 4  # gaps between lines of text


def test_a_small_house_says_how_many_points_fit(small_house, capsys):
    code, told = report(small_house, capsys)
    fits = int(told["facts"]["points that fit"])
    advice = next(f for f in told["findings"] if f["rule"] == "points")
    assert code == 0 and advice["severity"] == "warning" and 4 <= fits < 40
    points = advice["remedy"].split("--points ")[1].split(",")[0]
    house = Catalogue.load(str(small_house / "catalogue.toml"))
    for seed in range(3):
        sample_episode(house, objects=2, seed=seed, points=int(points))
