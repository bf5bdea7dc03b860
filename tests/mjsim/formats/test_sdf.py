"""Worlds in SDF files: poses, the saved state of Gazebo Classic, file names and limits."""

import numpy as np
import pytest
import trimesh

from mjsim.formats import sdf
from mjsim.formats.scene.source_scene import HouseOptions
from mjsim.formats.sdf import read_sdf
from mjsim.values.errors import AssetError

BOX = "<geometry><box><size>1 2 3</size></box></geometry>"
VISUAL = f"<visual name='v'>{BOX}</visual>"
LINK = f"<link name='l'>{VISUAL}</link>"


def model(name, content=LINK, pose="0 0 0 0 0 0"):
    return f"<model name='{name}'><pose>{pose}</pose>{content}</model>"


def bounds(tmp_path, content, state="", **options):
    """Return the bounding box of each model of a world: lower corner, upper corner."""
    path = tmp_path / "it.world"
    saved = f"<state world_name='w'>{state}</state>" if state else ""
    path.write_text(f"<sdf version='1.6'><world name='w'>{content}{saved}</world></sdf>")
    points = {}
    for piece in read_sdf(path, HouseOptions(**options)).pieces:
        points.setdefault(piece.name, []).append(piece.surface.corners.reshape(-1, 3))
    return {
        name: (np.concatenate(p).min(axis=0), np.concatenate(p).max(axis=0)) for name, p in points.items()
    }


def middle(found, name):
    return np.mean(found[name], axis=0)


def test_the_saved_state_replaces_the_pose_of_a_model(tmp_path):
    state = "<model name='a'><pose frame=''>5 6 7 0 0 1.5707963</pose></model>"
    found = bounds(tmp_path, model("a", pose="1 0 0 0 0 0") + model("b", pose="2 0 0 0 0 0"), state)
    np.testing.assert_allclose(middle(found, "a"), (5, 6, 7))
    np.testing.assert_allclose(found["a"][1] - found["a"][0], (2, 1, 3), atol=1e-5)
    np.testing.assert_allclose(middle(found, "b"), (2, 0, 0))


def test_links_that_the_state_does_not_name_move_with_their_model(tmp_path):
    two = f"<link name='l'><pose>0 0 1 0 0 0</pose>{VISUAL}</link>"
    found = bounds(tmp_path, model("a", two), "<model name='a'><pose>5 0 0 0 0 0</pose></model>")
    np.testing.assert_allclose(middle(found, "a"), (5, 0, 1))


def test_the_saved_pose_of_a_link_is_relative_to_the_world(tmp_path):
    state = "<model name='a'><pose>5 0 0 0 0 0</pose><link name='l'><pose>9 9 9 0 0 0</pose></link></model>"
    np.testing.assert_allclose(middle(bounds(tmp_path, model("a"), state), "a"), (9, 9, 9))


@pytest.mark.parametrize(
    "state",
    [
        "<model name='in'><pose>7 0 0 0 0 0</pose></model>",
        "<model name='in'><link name='l'><pose>7 0 0 0 0 0</pose></link></model>",
        "<link name='in::l'><pose>7 0 0 0 0 0</pose></link>",
    ],
)
def test_the_state_of_a_nested_model_counts(tmp_path, state):
    found = bounds(tmp_path, model("a", model("in", pose="1 1 1 0 0 0")), f"<model name='a'>{state}</model>")
    np.testing.assert_allclose(middle(found, "a"), (7, 0, 0))


def test_the_saved_scale_multiplies_boxes_and_keeps_cylinders_round(tmp_path):
    round_link = (
        "<link name='l'><visual name='v'><geometry><cylinder><radius>1</radius><length>1</length></cylinder>"
    )
    round_link += "</geometry></visual></link>"
    state = "".join(f"<model name='{name}'><scale>2 1 0.5</scale></model>" for name in "ab")
    found = bounds(tmp_path, model("a") + model("b", round_link), state)
    np.testing.assert_allclose(found["a"][1] - found["a"][0], (2, 2, 1.5))
    np.testing.assert_allclose(found["b"][1] - found["b"][0], (4, 4, 0.5), atol=0.02)


def test_the_saved_scale_replaces_that_of_a_mesh(tmp_path):
    trimesh.creation.box((1, 1, 1)).export(tmp_path / "cube.stl")
    link = "<link name='l'><visual name='v'><geometry><mesh><uri>cube.stl</uri><scale>3 3 3</scale></mesh></geometry>"
    link += "</visual></link>"
    state = "<model name='a'><scale>2 2 2</scale></model><model name='b'><scale>1 1 1</scale></model>"
    found = bounds(tmp_path, model("a", link) + model("b", link), state)
    assert [np.ptp(found[name], axis=0)[0] for name in "ab"] == [2, 3]


def test_inserted_models_are_added_and_deleted_ones_removed(tmp_path):
    state = (
        f"<insertions>{model('new', pose='3 0 0 0 0 0')}</insertions><deletions><name>old</name></deletions>"
    )
    state += "<model name='new'><pose>4 0 0 0 0 0</pose></model>"
    found = bounds(tmp_path, model("old") + model("kept"), state)
    assert set(found) == {"kept", "new"}
    np.testing.assert_allclose(middle(found, "new"), (4, 0, 0))


def test_only_the_first_state_of_a_world_counts(tmp_path):
    second = "</state><state><model name='a'><pose>9 0 0 0 0 0</pose></model>"
    found = bounds(tmp_path, model("a"), f"<model name='a'><pose>5 0 0 0 0 0</pose></model>{second}")
    np.testing.assert_allclose(middle(found, "a"), (5, 0, 0))


def test_an_included_model_takes_the_state_of_its_name_in_the_world(tmp_path):
    (tmp_path / "chair").mkdir()
    (tmp_path / "chair" / "model.sdf").write_text(f"<sdf version='1.6'>{model('chair')}</sdf>")
    include = "<include><uri>model://chair</uri><name>chair_7</name><pose>1 0 0 0 0 0</pose></include>"
    found = bounds(tmp_path, include, "<model name='chair_7'><pose>6 0 0 0 0 0</pose></model>")
    np.testing.assert_allclose(middle(found, "chair_7"), (6, 0, 0))


def test_a_file_of_the_authors_machine_is_looked_up_below_the_models(tmp_path):
    folder = tmp_path / "elsewhere" / "chair" / "meshes"
    folder.mkdir(parents=True)
    trimesh.creation.box((1, 1, 1)).export(folder / "chair.stl")
    uri = "file:///home/somebody/.gazebo/models/chair/meshes/chair.stl"
    link = (
        f"<link name='l'><visual name='v'><geometry><mesh><uri>{uri}</uri></mesh></geometry></visual></link>"
    )
    found = bounds(tmp_path, model("a", link), models=(tmp_path / "elsewhere",))
    np.testing.assert_allclose(np.ptp(found["a"], axis=0), (1, 1, 1))
    (folder / "chair.stl").rename(
        tmp_path / "elsewhere" / "chair.stl"
    )  # a file name alone may be another file
    with pytest.raises(AssetError, match="which is not there"):
        bounds(tmp_path, model("a", link), models=(tmp_path / "elsewhere",))


def test_a_model_that_includes_itself_twice_is_refused_at_once(tmp_path):
    (tmp_path / "twin").mkdir()
    include = "<include><uri>model://twin</uri></include>"
    (tmp_path / "twin" / "model.sdf").write_text(f"<sdf version='1.6'>{model('t', LINK + 2 * include)}</sdf>")
    with pytest.raises(AssetError, match="does one include itself"):
        bounds(tmp_path, include)


def test_more_models_or_triangles_than_a_house_has_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(sdf, "_MAX_MODELS", 9)
    with pytest.raises(AssetError, match="more than 9 models"):
        bounds(tmp_path, "".join(model(f"m{k}") for k in range(10)))
    monkeypatch.setattr(sdf, "MAX_TRIANGLES", 100)  # a box has 12
    with pytest.raises(AssetError, match="more than 100 triangles"):
        bounds(tmp_path, "".join(model(f"m{k}") for k in range(9)))
    assert len(bounds(tmp_path, "".join(model(f"m{k}") for k in range(8)))) == 8
