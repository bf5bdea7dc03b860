"""Compare HUD drawings with stored pictures. OpenGL is not needed, because markers are drawn as discs."""

import dataclasses
from pathlib import Path

import cv2
import hud_sample as sample
import numpy as np
import pytest

from hud.compose import compose
from hud.conditions import condition
from hud.messages import message
from hud.projection import project
from hud.state import Pointer
from mjsim.testing import compare_frame, drawing_key

FOLDER = Path(__file__).parents[1] / "golden"
SIZE = (640, 480)


def states():
    def state(name, count, steps, key, **labels):
        bar = None if key is None else message(key, sample.TEXTS, **labels)
        return condition(name)(sample.task(count, steps=steps, message=bar))

    return {
        "none": state("none", 12, 1, "picked", object="Blue mug"),
        "highlight": state("highlight", 12, 6, "hands_full"),
        "optimal": state("optimal", 24, 4, "replanned"),
        "hands_empty": state("none", 6, 0, None),
        "hands_full": state("none", 6, 2, "nothing_in_reach"),
        "finished": state("optimal", 6, 12, "finished"),
        "fading": dataclasses.replace(
            state("optimal", 12, 3, None), message=message("placed", sample.TEXTS, opacity=0.4)
        ),
        "map_and_pointer": dataclasses.replace(
            condition("optimal-minimap")(
                dataclasses.replace(sample.task(12, steps=1), bounds=(-4.0, -1.0, 4.0, 7.0), heading=1.2)
            ),
            pointer=Pointer(-2.6),
        ),
    }


def with_markers(frame, markers, dots=5):
    """Draw markers as discs along their height, which shows their position, size and colour."""
    camera = sample.camera(*SIZE)
    out = frame.copy()
    for marker in markers:
        length = marker.size[1] if marker.shape == "cylinder" else 0.0
        across = max(marker.size) if marker.shape == "box" else marker.size[0]
        for offset in np.linspace(-length, length, dots if length else 1):
            (pixel,), (depth,) = project(camera, [np.add(marker.position, (0.0, 0.0, offset))])
            if depth < 0.3:
                continue
            centre = np.rint(16.0 * pixel).astype(int)
            radius = max(16, round(16.0 * across * camera.focal / depth))
            colour = tuple(round(255 * c) for c in marker.rgba[:3])
            cv2.circle(out, (int(centre[0]), int(centre[1])), radius, colour, -1, cv2.LINE_8, 4)
    return out


def draw(state):
    return compose(
        with_markers(sample.backdrop(*SIZE), state.markers), state, sample.pictures(), sample.TEXTS
    )


@pytest.mark.parametrize("name", sorted(states()))
def test_pictures_are_as_they_were(name, tmp_path):
    compare_frame(draw(states()[name]), FOLDER / f"hud_{name}.png", key=drawing_key(), output=tmp_path)
