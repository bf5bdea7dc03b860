"""The client's own drawing, in Chromium with software WebGL, looks as mjsim's does, and takes few draws."""

import numpy as np
import pytest

from tools.drawn_pairs import draw_pairs, sampled_scene, ssim, views

LEAST, MEAN = 0.95, 0.97  # SSIM of a pair, and of all
MAX_DRAWS = 80
MAX_TRIANGLES = 150_000
MAX_MILLISECONDS = 2.0  # of the main thread for a frame, median of all


@pytest.fixture
def pairs(chromium):
    scene = sampled_scene()
    return draw_pairs(chromium, scene, views(scene))


@pytest.mark.slow
def test_pictures_of_all_rooms_look_as_those_of_mjsim(pairs, record_property):
    similar = [pair.similarity for pair in pairs]
    milliseconds = [pair.milliseconds for pair in pairs]
    record_property("main thread ms", f"median {np.median(milliseconds):.1f}, most {max(milliseconds):.1f}")
    assert len(pairs) == 21
    assert min(similar) >= LEAST
    assert np.mean(similar) >= MEAN
    assert np.median(milliseconds) <= MAX_MILLISECONDS
    assert max(pair.calls for pair in pairs) <= MAX_DRAWS
    assert max(pair.triangles for pair in pairs) <= MAX_TRIANGLES


def test_similarity_is_one_for_the_same_and_low_for_another_picture():
    rng = np.random.default_rng(0)
    image = rng.integers(0, 256, (48, 64, 3), np.uint8)
    assert ssim(image, image) == pytest.approx(1.0)
    assert ssim(image, rng.integers(0, 256, (48, 64, 3), np.uint8)) < 0.1
    assert 0.5 < ssim(image, image // 2) < 0.95
