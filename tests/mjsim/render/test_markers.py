"""Lines around markers behind walls, which stand out from the wall colours of generated homes."""

import re

import numpy as np
import pytest
from houses_cases import flat as six_rooms

from hud.markers import NAVY, WHITE, YELLOW
from mjsim.generator.palette import surfaces
from mjsim.render.markers import LINES, blend_hidden, outline_hidden

HOMES = 200
SHADES = (1.0, 0.75, 0.5, 0.25)  # light that reaches a wall
LEAST = 3.0  # contrast of WCAG 2.2, 1.4.11


def luminance(colour):
    share = np.asarray(colour) / 255.0
    linear = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    return linear @ (0.2126, 0.7152, 0.0722)


def contrast(a, b):
    high, low = max(luminance(a), luminance(b)), min(luminance(a), luminance(b))
    return (high + 0.05) / (low + 0.05)


@pytest.fixture(scope="module")
def walls():
    """Wall colours of homes, from bright to dark, in sRGB from 0 to 255."""
    plan = six_rooms()
    materials = [line for seed in range(HOMES) for line in surfaces(seed, plan) if 'name="wall_' in line]
    found = [
        np.array(re.search(r'rgba="([\d.]+) ([\d.]+) ([\d.]+)', line).groups(), float) for line in materials
    ]
    return [255.0 * shade * wall for wall in found for shade in SHADES]


def behind(wall, colour):
    """A picture of a wall with a pole behind it."""
    frame = np.full((480, 24, 3), np.round(wall), np.uint8)
    scene, marker = np.full(frame.shape[:2], 0.5, np.float32), np.zeros(frame.shape[:2], np.float32)
    marker[100:300, 10:12] = 0.2
    flat = np.broadcast_to(np.round(255 * np.array(colour[:3])).astype(np.uint8), frame.shape)
    blend_hidden(frame, flat, scene, marker)
    outline_hidden(frame, scene, marker)
    return frame


@pytest.mark.slow
def test_a_pole_behind_any_wall_of_200_homes_has_an_outline_of_3_to_1(walls):
    assert len(walls) >= HOMES * len(SHADES)
    for wall in walls:
        assert max(contrast(line, np.round(wall)) for line in LINES) >= LEAST


@pytest.mark.parametrize("colour", [NAVY, WHITE, YELLOW])
def test_every_row_of_a_hidden_pole_is_outlined_whatever_its_colour(walls, colour):
    for wall in walls[:: len(walls) // 40]:
        frame = behind(wall, colour)
        best = [max(contrast(pixel, frame[0, 0]) for pixel in row) for row in frame[100:300:50]]
        assert min(best) >= LEAST


def test_lines_neither_cover_the_marker_nor_surround_what_is_seen():
    frame = np.full((480, 24, 3), 200, np.uint8)
    scene, marker = np.full(frame.shape[:2], 0.5, np.float32), np.zeros(frame.shape[:2], np.float32)
    marker[100:300, 10:12] = 0.2
    marker[100:200, 10:12] = 0.9  # the upper half is in front of the wall
    before = frame.copy()
    outline_hidden(frame, scene, marker)
    changed = np.any(frame != before, axis=2)
    assert not changed[marker > 0].any() and not changed[100:190].any()
    assert changed[210:300].any(axis=1).all()
    marker[:] = 0.0
    outline_hidden(before, scene, marker)
    assert (before == 200).all()
