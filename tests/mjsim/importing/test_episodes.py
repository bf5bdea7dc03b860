"""`mjsim import episodes`: what is out of place in episodes of RoomR and Housekeep, and how far."""

import gzip
import json
import os
import pickle

import numpy as np
import pytest

from experiments.cli import main as cli
from mjsim.house.scene.disorder import Disorder
from mjsim.importing.episodes import EpisodeObject, kind_of, read_episodes
from mjsim.values.episode import Episode
from mjsim.values.errors import EpisodeError


def pose(name, x, y, z):
    return {"name": name, "position": {"x": x, "y": y, "z": z}, "rotation": {"x": 0.0, "y": 90.0, "z": 0.0}}


def roomr():
    """One episode: a mug that is 3 m away, a pan in its place, an egg that fell out of the scene, a fridge ajar."""
    return {
        "FloorPlan1": [
            {
                "starting_poses": [
                    pose("Mug_1", 0, 1, 0),
                    pose("Pan_2", 1, 1, 1),
                    pose("Egg_3", 0, -400, 400.0),
                ],
                "target_poses": [
                    pose("Pan_2", 1, 1.01, 1),
                    pose("Egg_3", 0, 1, 0),
                    pose("Mug_1", 3.0, 0.2, 0),
                ],
                "openable_data": [{"name": "Fridge_4", "start_openness": 0.9, "target_openness": 0.3}],
            }
        ]
    }


def housekeep():
    """One episode of three objects: in place, on the wrong one of three places, and right nowhere."""
    return {
        "scene_id": "data/scenes/Rs_int.glb",
        "episode_id": 7,
        "objs_keys": ["cup_1", "cup_2", "lamp_1"],
        "objs_cats": ["cup", "cup", "lamp"],
        "objs_pos": [[0, 1, 0], [0, 2, 0], [0, 0, 0]],
        "recs_pos": [[0, 0, 0], [3, 0, 4], [9, 0, 9]],
        "start_matrix": [[1, 1, 1], [0, 0, 0], [0, 0, 0]],
        "end_matrix": [[1, 0, 0], [1, 1, 0], [0, 1, 0]],
    }


def written(path, content):
    data = content if isinstance(content, bytes) else json.dumps(content).encode()
    path.write_bytes(gzip.compress(data) if path.name.endswith(".gz") else data)
    return path


@pytest.mark.parametrize("name", ["val.pkl.gz", "val.pkl"])
def test_roomr_has_objects_that_moved_and_doors_that_are_ajar(tmp_path, name):
    found = read_episodes(written(tmp_path / name, pickle.dumps(roomr())))
    assert found == [
        EpisodeObject("FloorPlan1", "0", "Mug_1", "Mug", "misplaced", 3.0),
        EpisodeObject("FloorPlan1", "0", "Pan_2", "Pan", "in place"),
        EpisodeObject("FloorPlan1", "0", "Egg_3", "Egg", "misplaced"),
        EpisodeObject("FloorPlan1", "0", "Fridge_4", "Fridge", "opened"),
    ]


def test_housekeep_has_objects_on_places_where_they_may_not_be(tmp_path):
    found = read_episodes(written(tmp_path / "Rs_int.json.gz", {"episodes": [housekeep()]}))
    assert [(o.name, o.state, o.distance) for o in found] == [
        ("cup_1", "in place", None),
        ("cup_2", "misplaced", 5.0),
        ("lamp_1", "misplaced", None),
    ]
    assert (found[0].scene, found[0].episode) == ("Rs_int", "7")


class Hostile:
    def __init__(self, *call):
        self.call = call

    def __reduce__(self):
        return self.call


def test_a_pickle_that_names_a_function_is_refused_and_nothing_is_run(tmp_path):
    trace = tmp_path / "trace"
    for protocol in (0, 2, 4):
        data = pickle.dumps({"FloorPlan1": Hostile(os.mkdir, (str(trace),))}, protocol)
        with pytest.raises(EpisodeError, match=r"names posix\.mkdir"):
            read_episodes(written(tmp_path / "bad.pkl.gz", data))
    assert not trace.exists()


@pytest.mark.parametrize(
    "data",
    [
        pickle.dumps(np.zeros(3)),  # its functions are refused
        pickle.dumps(roomr())[:-40],
        b"",
        b"\x80\x04K\x01r\xff\xff\xff\xff.",  # a memo for 2^32 values
        b"\x80\x05\x96" + (1 << 62).to_bytes(8, "little") + b".",  # a bytearray of 2^62 bytes
        b"(" * 100_000 + b"l" * 100_000 + b".",  # deep
        b"\x80\x04Pfile\n.",  # a persistent object
        pickle.dumps({"FloorPlan1": [{"starting_poses": [pose("Mug_1", 0, "x", 0)], "target_poses": []}]}),
        pickle.dumps({"FloorPlan1": [{"starting_poses": [pose("Mug_1", 0, 1, 0)], "target_poses": []}]}),
        pickle.dumps({}),
    ],
)
def test_a_damaged_or_hostile_pickle_is_refused_in_one_line(tmp_path, data):
    with pytest.raises(EpisodeError) as caught:
        read_episodes(written(tmp_path / "bad.pkl", data))
    assert str(caught.value).startswith(str(tmp_path / "bad.pkl"))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "change", "reason"),
    [
        ("a.json", {"objs_pos": [[0, 0, 0]]}, "do not fit 3 places and 3 objects"),
        ("a.json", {"end_matrix": [[1, 0, 0]]}, "do not fit"),
        ("a.json", {"recs_pos": "here"}, "array"),
        ("a.txt", {}, "unknown kind of file"),
    ],
)
def test_damaged_episodes_of_housekeep_are_refused_by_their_cause(tmp_path, name, change, reason):
    with pytest.raises(EpisodeError, match=reason):
        read_episodes(written(tmp_path / name, {"episodes": [housekeep() | change]}))


def test_a_file_that_is_cut_off_is_refused(tmp_path):
    path = written(tmp_path / "a.json.gz", {"episodes": [housekeep()]})
    path.write_bytes(path.read_bytes()[:-20])
    with pytest.raises(EpisodeError, match="is it complete"):
        read_episodes(path)


def test_kinds_are_words():
    assert kind_of("ButterKnife") == kind_of("butter_knife") == "butter knife"


def test_disorder_is_drawn_as_it_was_observed():
    disorder = Disorder((0, 2, 2, 9), (1.0, 4.0))
    assert {disorder.count(seed, 5) for seed in range(20)} == {2}
    points, homes = np.column_stack((np.arange(10.0), np.zeros(10))), np.zeros((3, 2))
    rows = disorder.assign(points, homes, 0)
    assert len(set(rows)) == 3
    assert all(min(abs(points[row, 0] - d) for d in disorder.distances) <= 1 for row in rows)
    with pytest.raises(EpisodeError, match="allow more"):
        Disorder((0, 9), (1.0,)).count(0, 5)


def test_the_command_writes_tables_and_episodes_of_our_house(tmp_path, capsys):
    files = [
        written(tmp_path / "val.pkl.gz", pickle.dumps(roomr())),
        written(tmp_path / "Rs_int.json", {"episodes": [housekeep()]}),
    ]
    out = tmp_path / "disorder"
    assert cli.main(["import", "episodes", *map(str, files), "--out", str(out), "--episodes", "2"]) == 0
    assert "out of place: 4, of 6; in an episode 2 in 100 %" in capsys.readouterr().out
    assert len((out / "objects.csv").read_text().splitlines()) == 8
    assert Disorder.load(out / "disorder.json") == Disorder((2, 2), (3.0, 5.0))
    assert (out / "disorder.png").is_file()
    assert [len(Episode.load(out / f"episode_{k}.json").objects) for k in range(2)] == [2, 2]
    (out / "disorder.json").write_text('{"misplaced": [], "distances": []}')
    with pytest.raises(EpisodeError, match="no misplaced object"):
        Disorder.load(out / "disorder.json")
