"""`mjsim house export --format habitat`: what our own importer reads back is the same house."""

import gzip
import json

import numpy as np
import pytest

from experiments.cli import main as cli
from experiments.house import House
from mjsim.formats.scene.source_scene import HouseOptions
from mjsim.generator.home_cache import load_catalogue
from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.compiled.house import compiled_house
from mjsim.importing.house.house_import import import_house

Z_TO_Y = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1.0]])


def check_episode(house, folder):
    """The second episode of a folder is that of seed 4."""
    expected = house.sample_episode(objects=3, seed=4)
    episode = json.loads(gzip.decompress((folder / "episodes.json.gz").read_bytes()))["episodes"][1]
    x, y, heading = expected.start.x, expected.start.y, expected.start.heading
    np.testing.assert_allclose(episode["start_position"], (x, 0, -y))
    turn = 2 * np.arctan2(episode["start_rotation"][1], episode["start_rotation"][3])
    ahead = (-np.sin(turn), -np.cos(turn))  # of -z, in x and z
    np.testing.assert_allclose(ahead, (np.cos(heading), -np.sin(heading)), atol=1e-9)
    targets = zip(expected.objects, episode["rigid_objs"], episode["targets"].items(), strict=True)
    for number, (placed, (template, pose), (handle, goal)) in enumerate(targets):
        assert (folder / "objects" / template).is_file()
        assert handle.startswith(template.split(".")[0])
        np.testing.assert_allclose(np.array(pose)[:3, 3], (Z_TO_Y @ (*placed.position, 1))[:3])
        receptacle = expected.targets[placed.name]
        centre = house.receptacles[receptacle].center
        np.testing.assert_allclose(np.array(goal)[:3, 3], (Z_TO_Y @ (*centre, 1))[:3])
        assert episode["goal_receptacles"][number][0] == f"{receptacle}_:0000"


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["apartment", "generated:7?rooms=5", pytest.param("generated:31?rooms=2", marks=pytest.mark.long)]
)
def test_a_house_comes_back_with_its_rooms_floor_and_bins(tmp_path, name, capsys):
    out = tmp_path / "habitat"
    options = ["--episodes", "2", "--objects", "3", "--seed", "3", "--out", str(out)]
    assert cli.main(["house", "export", "--house", name, *options]) == 0
    scene = next((out / "scenes").iterdir())
    assert str(scene) in capsys.readouterr().out
    _, report = import_house(scene, tmp_path / "back", HouseOptions())
    assert [f for f in report.findings if f.severity == "error"] == []
    ours, again = load_catalogue(name), Catalogue.load(str(tmp_path / "back"))
    assert again.rooms == ours.rooms
    assert {r.key: (r.room, r.place) for r in again.receptacles.values()} == {
        r.key: (r.room, r.place) for r in ours.receptacles.values()
    }
    one, other = compiled_house(ours), compiled_house(again)
    for key, receptacle in one.receptacles.items():
        np.testing.assert_allclose(other.receptacles[key].center, receptacle.center, atol=1e-3)
    rng = np.random.default_rng(0)
    for here, there in ((one, other), (other, one)):
        points = np.array([here.navigable.sample(rng) for _ in range(1000)])
        same = [np.linalg.norm(there.navigable.snap(p, np.inf) - p) < 0.03 for p in points]
        assert np.mean(same) >= 0.98
        assert np.mean([here.rooms.room_at(p) == there.rooms.room_at(p) for p in points]) >= 0.98
    check_episode(House.load(name), out)
