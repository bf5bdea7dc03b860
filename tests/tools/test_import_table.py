"""The table of imported public scenes measures whether models are where the source places them."""

import numpy as np
import pytest
from house_scenes import write_sdf

from mjsim.formats.scene.source_scene import HouseOptions
from mjsim.formats.sdf_poses import SavedState
from mjsim.support.toml import read_toml
from tools.import_table import SCENES, distances, scene_row

MOVED = "<state world_name='flat'><model name='sofa'><pose>3 4 0.3 0 0 1</pose>"
MOVED += "<link name='l'><pose>3.2 4 0.3 0.2 0 1.5</pose></link></model></state>"


def test_models_are_where_the_source_places_them(tmp_path):
    found = list(distances(write_sdf(tmp_path, extra=MOVED), HouseOptions()))
    assert len(found) == 11  # floor, six walls, door, sofa, cup and the included table
    np.testing.assert_allclose(found, 0, atol=1e-9)


def test_a_model_elsewhere_is_found(tmp_path, monkeypatch):
    for name in ("model_frame", "link_frame"):  # as if the state had no poses
        monkeypatch.setattr(SavedState, name, lambda *arguments: arguments[-1])
    found = list(distances(write_sdf(tmp_path, extra=MOVED), HouseOptions()))
    assert [distance > 3 for distance in found].count(True) == 1


def test_a_refused_scene_is_a_row_with_its_reason(tmp_path):
    source = tmp_path / "empty.world"
    source.write_text("<sdf version='1.6'><world name='w'/></sdf>")
    row = scene_row("empty", source, ())
    assert str(row).startswith("| empty |  |  |") and "refused: has no model with a shape" in str(row)


@pytest.mark.slow
def test_a_usable_scene_is_a_row_with_its_size_and_places(tmp_path):
    row = scene_row("flat", write_sdf(tmp_path, extra=MOVED), ())
    assert (row.in_place, row.models, row.outline, row.rooms) == (11, 11, "closed by its walls", "2")
    assert str(row).endswith("| **usable** |")
    assert int(row.places.split()[0]) >= 6


def test_each_listed_scene_has_a_commit():
    listed = read_toml(SCENES)
    assert sum(map(len, listed["scenes"].values())) == 20
    assert set(listed["scenes"]) <= set(listed["commits"])
    assert all(len(commit) == 40 for commit in listed["commits"].values())
