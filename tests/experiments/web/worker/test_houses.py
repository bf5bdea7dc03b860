"""What is made once per house: pictures for the instructions, and one for the welcome page."""

import base64

import cv2
import numpy as np
import pytest

from experiments.trials.trial_config import TrialConfig
from experiments.web.viewing import page
from experiments.web.worker import houses, marker_picture
from mjsim.formats.gltf.cache import view_path


def test_the_instructions_are_the_same_in_all_conditions_and_for_all_participants(house, monkeypatch):
    monkeypatch.setattr(houses, "encoded_pictures", lambda *_: {})
    conditions = ("none", "highlight", "optimal-minimap", "guided-xray")
    configs = [
        TrialConfig(assistance=name, objects=3 + seed, seed=seed) for seed, name in enumerate(conditions)
    ]
    for language, labels in (("en", ["Blue mug", "Dish bin"]), ("de", ["Blaue Tasse", "Geschirrkorb"])):
        home = house.in_language(language)
        shown = {tuple(houses.shown_pictures(config, home).example.items()) for config in configs}
        assert shown == {tuple(zip(("object:mug", "receptacle:dish_bin"), labels, strict=True))}


@pytest.mark.slow
def test_the_object_and_the_bin_of_the_instructions_have_pictures(house):
    shown = houses.shown_pictures(TrialConfig(assistance="none", objects=3, seed=0), house)
    assert len(shown.example) == 2 and shown.example.keys() <= shown.pictures.keys()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("condition", "roles"),
    [("none", ()), ("highlight", ("flagpole",)), ("optimal", ("breadcrumb", "flagpole"))],
)
def test_the_markers_of_a_condition_are_drawn_once_and_seen_in_their_picture(
    tmp_path, house, monkeypatch, condition, roles
):
    monkeypatch.setattr(marker_picture, "scenes_folder", lambda: tmp_path)
    monkeypatch.setattr(houses, "encoded_pictures", lambda *_: {})
    config = TrialConfig(assistance=condition, objects=3, seed=0)
    assert houses.shown_pictures(config, house).pictures == {}
    shown = houses.shown_pictures(config, house, explained=True)
    assert (shown.markers, "markers" in shown.pictures) == (roles, bool(roles))
    monkeypatch.setattr(marker_picture, "_draw", None)  # so that a second drawing would fail
    assert (
        houses.shown_pictures(TrialConfig(assistance=condition, objects=5, seed=9), house, explained=True)
        == shown
    )
    if roles:
        content = base64.b64decode(shown.pictures["markers"].partition(",")[2])
        blue, green, red = cv2.split(
            cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_COLOR).astype(int)
        )
        dots = np.count_nonzero((red > 180) & (green < 40) & (blue < 40))
        assert bool(dots > 300) is ("breadcrumb" in roles)


def no_opengl(*_):
    raise ImportError("no OpenGL")


@pytest.mark.slow
def test_the_picture_of_a_house_is_drawn_once_and_is_no_part_of_its_scene(tmp_path, house, monkeypatch):
    for module in (houses, page):
        monkeypatch.setattr(module, "scenes_folder", lambda: tmp_path)
    path = view_path(house.catalogue, tmp_path)
    with monkeypatch.context() as blind, pytest.raises(ImportError):
        blind.setattr(houses, "draw_largest_room", no_opengl)
        houses.make_files(house)
    assert path.read_bytes() == b""
    houses.make_files(house)
    picture, drawn = cv2.imread(str(path)), path.stat().st_mtime_ns
    assert picture.shape == (600, 1200, 3) and picture.std() > 30.0
    houses.make_files(house)
    assert path.stat().st_mtime_ns == drawn
    files = page._scene(house, set())
    assert "scene.json" in files and path.name not in files
