"""The client's own drawing, in Chromium with software WebGL, looks as mjsim's does, and takes few draws."""

import dataclasses

import numpy as np
import pytest

from hud.markers import flagpole
from tools.drawn_pairs import View, draw_pairs, sampled_scene, ssim, views

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("drawing")]

LEAST, MEAN = 0.95, 0.97  # SSIM of a pair, and of all
# A person in the hall looks at a wall, and a pole is behind it in the bedroom.
BEHIND_A_WALL, POLE = (6.4, 5.15, 3.36, 0.0), flagpole((1.2, 2.6, 0.0), x_ray=True)
MAX_DRAWS = 90
MAX_TRIANGLES = 150_000


@pytest.fixture
def pairs(chromium):
    scene = sampled_scene()
    return draw_pairs(chromium, scene, views(scene))


def test_pictures_of_all_rooms_look_as_those_of_mjsim(pairs, record_property):
    similar = [pair.similarity for pair in pairs]
    milliseconds = [pair.milliseconds for pair in pairs]
    record_property("main thread ms", f"median {np.median(milliseconds):.1f}, most {max(milliseconds):.1f}")
    assert len(pairs) == 21
    assert min(similar) >= LEAST
    assert np.mean(similar) >= MEAN
    assert max(pair.calls for pair in pairs) <= MAX_DRAWS
    assert max(pair.triangles for pair in pairs) <= MAX_TRIANGLES


def contrasts(picture, bare):
    """Contrast (WCAG 2.2) of each pixel that differs from a picture without markers."""
    changed = np.any(picture != bare, axis=2)
    light, dark = (np.sort([luminance(p[changed]) for p in (picture, bare)], axis=0)[i] for i in (1, 0))
    return (light + 0.05) / (dark + 0.05)


def luminance(colours):
    return np.clip((colours / 255.0 + 0.055) / 1.055, 0.0, 1.0) ** 2.4 @ (0.2126, 0.7152, 0.0722)


def test_a_flagpole_behind_a_wall_has_an_outline_of_3_to_1_in_both_renderers(chromium):
    scene = sampled_scene()
    bare = View("Bedroom", *BEHIND_A_WALL)
    pairs = draw_pairs(chromium, scene, [bare, dataclasses.replace(bare, markers=POLE)])
    for pictures in ([pair.mjsim for pair in pairs], [pair.browser for pair in pairs]):
        found = contrasts(pictures[1], pictures[0])
        assert len(found) > 100 and np.mean(found >= 3.0) > 0.2, "one of two lines on each side"


def test_similarity_is_one_for_the_same_and_low_for_another_picture():
    rng = np.random.default_rng(0)
    image = rng.integers(0, 256, (48, 64, 3), np.uint8)
    assert ssim(image, image) == pytest.approx(1.0)
    assert ssim(image, rng.integers(0, 256, (48, 64, 3), np.uint8)) < 0.1
    assert 0.5 < ssim(image, image // 2) < 0.95
