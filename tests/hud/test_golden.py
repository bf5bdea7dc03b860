"""Golden pictures of HUD states, drawn without OpenGL: world-locked markers are projected as discs."""

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
from mjsim.testing import FrameMismatchError, compare_frame, drawing_key

FOLDER = Path(__file__).parents[1] / "golden"
SIZE = (640, 480)


def states():
    def state(name, count, steps, key, **labels):
        bar = None if key is None else message(key, **labels)
        return condition(name)(sample.task(count, steps=steps, message=bar))

    return {
        "none": state("none", 12, 1, "picked", object="Blue mug"),
        "highlight": state("highlight", 12, 6, "hands_full"),
        "optimal": state("optimal", 24, 4, "replanned"),
        "hands_empty": state("none", 6, 0, None),
        "hands_full": state("none", 6, 2, "nothing_in_reach"),
        "finished": state("optimal", 6, 12, "finished"),
        "fading": dataclasses.replace(state("optimal", 12, 3, None), message=message("placed", opacity=0.4)),
        "map_and_pointer": dataclasses.replace(
            condition("optimal-minimap")(
                dataclasses.replace(sample.task(12, steps=1), bounds=(-4.0, -1.0, 4.0, 7.0), heading=1.2)
            ),
            pointer=Pointer(-2.6),
        ),
    }


def with_markers(frame, markers, dots=5):
    """Draw markers as discs along their height: enough to see where they are, what size and what colour."""
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
    return compose(with_markers(sample.backdrop(*SIZE), state.markers), state, sample.pictures())


@pytest.mark.parametrize("name", sorted(states()))
def test_pictures_are_as_they_were(name, tmp_path):
    compare_frame(draw(states()[name]), FOLDER / f"hud_{name}.png", key=drawing_key(), output=tmp_path)


def moved_breadcrumb(state):
    markers = list(state.markers)
    x, y, z = markers[3].position  # those before it are at the feet, out of view
    markers[3] = dataclasses.replace(markers[3], position=(x + 0.05, y, z))
    return dataclasses.replace(state, markers=tuple(markers))


def with_row(state, index, **change):
    rows = list(state.checklist)
    rows[index] = dataclasses.replace(rows[index], **change)
    return dataclasses.replace(state, checklist=tuple(rows))


def swapped_hands(state):
    left, right = state.inventory
    return dataclasses.replace(state, inventory=(right, left))


MUTATIONS = {
    "a breadcrumb moves by 5 cm": ("optimal", moved_breadcrumb),
    "a label changes": ("optimal", lambda s: with_row(s, 4, text="Blue jug")),
    "a step is no longer crossed out": ("optimal", lambda s: with_row(s, 3, done=False)),
    "the hands change places": ("none", swapped_hands),
    "a flag is missing": ("highlight", lambda s: dataclasses.replace(s, markers=s.markers[9:])),
    "the title changes": ("none", lambda s: dataclasses.replace(s, checklist_title="Objects to find")),
    "the list has another order": ("none", lambda s: dataclasses.replace(s, checklist=s.checklist[::-1])),
    "the message changes": ("hands_full", lambda s: dataclasses.replace(s, message=message("out_of_reach"))),
    "a place changes": ("highlight",
        lambda s: dataclasses.replace(s, bins=(dataclasses.replace(s.bins[0], place="Attic"), *s.bins[1:]))),
    "a pointer appears": ("optimal", lambda s: dataclasses.replace(s, pointer=Pointer(0.5))),
}  # fmt: skip


@pytest.mark.parametrize("key", [drawing_key(), "OpenCV of somebody else"])
@pytest.mark.parametrize("what", sorted(MUTATIONS))
def test_a_mutation_fails(what, key, tmp_path):
    name, mutate = MUTATIONS[what]
    frame = draw(mutate(states()[name]))
    with pytest.raises(FrameMismatchError, match=f"hud_{name}.png has changed"):
        compare_frame(frame, FOLDER / f"hud_{name}.png", key=key, update=False, output=tmp_path)
