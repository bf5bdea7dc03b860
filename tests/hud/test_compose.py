"""Tests of the drawn HUD: determinism, legibility at all supported sizes, and colour-blind safety."""

import dataclasses
import math

import cv2
import hud_sample as sample
import numpy as np
import pytest

from hud import markers, minimap, theme
from hud.canvas import Canvas
from hud.compose import Compositor, compose
from hud.conditions import condition
from hud.errors import FrameError
from hud.messages import message
from hud.panels import clock_text
from hud.state import ChecklistItem, HudState, InventorySlot, Message, MessageKind, Pointer
from mjsim.house.catalogue.catalogue import Catalogue

SIZES = ((640, 480), (1280, 720), (1920, 1080))


def optimal(count=6, steps=3):
    return condition("optimal")(sample.task(count, steps=steps, message=message("replanned", sample.TEXTS)))


def plain(size, level):
    return np.full((size[1], size[0], 3), level, dtype=np.uint8)


def ink(state, other, size, level=0):
    """Return a mask of the pixels in which the drawings of two states differ clearly."""
    a, b = (
        compose(plain(size, level), s, sample.pictures(), sample.TEXTS).astype(int) for s in (state, other)
    )
    return np.asarray(np.abs(a - b).max(axis=2) > 100)


def text_height(state, other, size):
    rows = np.flatnonzero(ink(state, other, size).any(axis=1))
    return int(rows[-1] - rows[0] + 1)


def test_the_frame_given_is_left_alone_be_it_read_only_or_strided():
    frame = sample.backdrop(640, 480)
    before = frame.copy()
    frame.setflags(write=False)
    drawn = compose(frame, optimal(), sample.pictures(), sample.TEXTS)
    assert np.array_equal(frame, before) and drawn.shape == frame.shape and drawn.dtype == np.uint8
    assert not np.array_equal(drawn, frame)
    strided = np.ascontiguousarray(frame[::-1])[::-1]
    assert np.array_equal(compose(strided, optimal(), sample.pictures(), sample.TEXTS), drawn)


@pytest.mark.slow
def test_what_a_compositor_drew_before_does_not_matter():
    pictures = sample.pictures()
    kept = Compositor(pictures, sample.TEXTS)
    for size in (SIZES[0], (1366, 768), SIZES[0]):
        frame = sample.backdrop(*size)
        for count, steps in ((6, 3), (24, 9), (6, 4), (6, 3)):
            for name in ("none", "highlight", "optimal"):
                view = sample.task(
                    count, steps=steps, message=message("hands_full", sample.TEXTS, opacity=0.2 * steps)
                )
                state = condition(name)(dataclasses.replace(view, clock=float(steps)))
                assert np.array_equal(
                    kept.compose(frame, state), compose(frame, state, pictures, sample.TEXTS)
                )


def test_a_panel_is_drawn_again_only_when_it_says_something_else(monkeypatch):
    drawn = []
    panel = Canvas.panel

    def spy(stencils, rect):
        drawn.append(rect)
        return panel(stencils, rect)

    monkeypatch.setattr(Canvas, "panel", spy)
    kept = Compositor(sample.pictures(), sample.TEXTS)
    frame = sample.backdrop(640, 480)
    kept.compose(frame, optimal(24, 20))
    panels = kept.layout(optimal(24, 20), 640, 480).panels
    changes = (({}, []), ({"clock": 500.0}, ["clock"]), ({"clock": 500.0, "delivered": 3}, ["progress"]))
    for change, expected in changes:
        drawn.clear()
        kept.compose(frame, dataclasses.replace(optimal(24, 20), **change))
        assert [(r.width, r.height) for r in drawn] == [(panels[n].width, panels[n].height) for n in expected]


PARTS = {
    "title": {"checklist_title": "Other"},
    "row": {"checklist": (ChecklistItem("Other", ""),)},
    "bins": {"bins": ()},
    "hands": {"inventory": (InventorySlot("Spoon"), InventorySlot())},
    "message": {"message": Message("Other", MessageKind.INFO)},
    "tone": {"message": Message(message("replanned", sample.TEXTS).text, MessageKind.REFUSAL)},
    "fade": {"message": message("replanned", sample.TEXTS, opacity=0.5)},
    "delivered": {"delivered": 5},
    "total": {"total": 7},
    "clock": {"clock": 90.0},
    "pointer": {"pointer": Pointer(1.0)},
}


@pytest.mark.parametrize("part", sorted(PARTS))
def test_every_part_of_the_state_shows(part):
    kept = Compositor(sample.pictures(), sample.TEXTS)
    frame = sample.backdrop(640, 480)
    before = kept.compose(frame, optimal())
    assert not np.array_equal(before, kept.compose(frame, dataclasses.replace(optimal(), **PARTS[part])))


@pytest.mark.parametrize("size", SIZES)
def test_capitals_are_at_least_nine_pixels_high_at_480_and_grow_with_the_frame(size):
    def state(text, detail):
        row = ChecklistItem(text, detail, current=False)
        return HudState("T", (row,), (), (InventorySlot(), InventorySlot()))

    wanted = 9 * size[1] // 480
    assert text_height(state("HHHH", "x"), state("", "x"), size) >= wanted
    assert text_height(state("x", "HHHH"), state("x", "IIII"), size) >= wanted
    bar = dataclasses.replace(state("x", "x"), message=Message("HHHH HHHH", MessageKind.INFO))
    other = dataclasses.replace(bar, message=Message("IIII IIII IIII", MessageKind.INFO))
    assert text_height(bar, other, size) >= wanted
    held = dataclasses.replace(state("x", "x"), inventory=(InventorySlot("HHHH"), InventorySlot()))
    other = dataclasses.replace(held, inventory=(InventorySlot("IIII"), InventorySlot()))
    assert text_height(held, other, size) >= wanted


def luminance(rgb):
    """Return the relative luminance of an sRGB colour (0 to 255) as defined by WCAG 2."""
    c = np.asarray(rgb, dtype=np.float64) / 255.0
    linear = np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)
    return np.asarray(linear @ np.array([0.2126, 0.7152, 0.0722]))


@pytest.mark.parametrize("level", [0, 128, 255])
@pytest.mark.parametrize("done", [False, True])
def test_text_contrast_holds_over_any_background(level, done):
    size = (1920, 1080)  # large enough that strokes cover some pixels completely
    for text, detail, rest in (("HHHHHH", "x", "x"), ("", "HHHHHHH", "")):
        blank = HudState("", (ChecklistItem("", rest, done=done),), (), (InventorySlot(), InventorySlot()))
        state = dataclasses.replace(blank, checklist=(ChecklistItem(text, detail, done=done),))
        drawn = compose(plain(size, level), state, {}, sample.TEXTS)
        covered = ink(state, blank, size, level)
        panel = compose(plain(size, level), blank, {}, sample.TEXTS)[covered]
        brightest = luminance(drawn[covered]).max()
        ratio = (brightest + 0.05) / (luminance(panel).max() + 0.05)
        assert ratio >= 4.5


# Simulate complete colour-vision deficiencies on linear RGB (Machado, Oliveira and Fernandes, 2009).
DEFICIENCIES = {
    "none": np.eye(3),
    "protan": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216],
        [-0.003882, -0.048116, 1.051998]],
    "deutan": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413],
        [-0.011820, 0.042940, 0.968881]],
    "tritan": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602],
        [0.004733, 0.691367, 0.303900]],
}  # fmt: skip


def byte(rgba):
    """Return a marker's colour with values from 0 to 255."""
    return tuple(255.0 * c for c in rgba[:3])


# Pairs of colours that the participant must be able to tell apart
PAIRS = {
    "message: success, refusal": (theme.TONES[MessageKind.SUCCESS], theme.TONES[MessageKind.REFUSAL]),
    "message: success, information": (theme.TONES[MessageKind.SUCCESS], theme.TONES[MessageKind.INFO]),
    "message: refusal, information": (theme.TONES[MessageKind.REFUSAL], theme.TONES[MessageKind.INFO]),
    "breadcrumb, its rim": (byte(markers.RED), byte(markers.WHITE)),
    "breadcrumb, pin at the goal": (byte(markers.RED), byte(markers.SKY)),
    "flag, its lower band": (byte(markers.YELLOW), byte(markers.NAVY)),
    "bands of a pole": (byte(markers.WHITE), byte(markers.NAVY)),
    "map: path, goal": (minimap.PATH, minimap.GOAL),
    "map: object, its rim": (minimap.OBJECT, theme.PANEL),
    "map: goal, its rim": (minimap.GOAL, theme.PANEL),
    "map: person, its rim": (theme.ACCENT, theme.PANEL),
    "map: person, path": (theme.ACCENT, minimap.PATH),
    "current step, panel": (theme.ACCENT, theme.PANEL),
    "progress, panel": (theme.PROGRESS, theme.PANEL),
}


@pytest.mark.parametrize("kind", sorted(DEFICIENCIES))
def test_colours_stay_apart_for_colour_vision_deficiencies(kind):
    for pair, colours in PAIRS.items():
        linear = ((np.array(colours, dtype=np.float64) / 255.0 + 0.055) / 1.055) ** 2.4
        seen = np.clip(linear @ np.array(DEFICIENCIES[kind]).T, 0.0, 1.0).astype(np.float32)
        first, second = cv2.cvtColor(seen[None], cv2.COLOR_LRGB2Lab)[0]
        assert float(np.linalg.norm(first - second)) > 20.0, pair


def test_tones_differ_by_more_than_their_colour():
    frame = plain((640, 480), 128)
    shapes = []
    for kind in MessageKind:
        state = dataclasses.replace(optimal(), message=Message("Same text", kind))
        rect = Compositor({}, sample.TEXTS).layout(state, 640, 480).panels["message"]
        patch = compose(frame, state, {}, sample.TEXTS)[rect.y : rect.bottom, rect.x : rect.x + 32].astype(
            np.float64
        )
        tone = np.array(theme.TONES[kind], dtype=np.float64)
        shapes.append(np.abs(patch - tone).max(axis=2) < 12)
    assert all((shapes[i] ^ shapes[j]).sum() > 15 for i in range(3) for j in range(i))


@pytest.mark.parametrize("size", [*SIZES, (1024, 768), (1366, 768)])
def test_names_of_what_the_hands_hold_are_never_cut(size, monkeypatch):
    written = []
    text = Canvas.text

    def spy(canvas, x, baseline, line, *rest):
        written.append(line)
        return text(canvas, x, baseline, line, *rest)

    monkeypatch.setattr(Canvas, "text", spy)
    compositor = Compositor({}, sample.TEXTS)
    for label in sorted({model.label for model in Catalogue.load().objects.values()}):
        state = HudState("", (), (), (InventorySlot(label), InventorySlot(label)))
        written.clear()
        compositor.compose(plain(size, 0), state)
        assert " ".join(written) == f"{label} {label}"


@pytest.mark.parametrize("angle", [0.0, 1.5707963, 3.1415926, -1.5707963])
def test_the_pointer_sits_at_the_edge_it_points_to(angle):
    layout = Compositor({}, sample.TEXTS).layout(
        dataclasses.replace(optimal(), pointer=Pointer(angle)), 640, 480
    )
    free, rect = layout.free, layout.panels["pointer"]
    dx = rect.x + rect.width / 2 - (free.x + free.width / 2)
    dy = rect.y + rect.height / 2 - (free.y + free.height / 2)
    assert abs(math.remainder(np.arctan2(-dy, dx) - angle, math.tau)) < 0.05


@pytest.mark.parametrize(
    ("seconds", "text"), [(0.0, "0:00"), (59.99, "0:59"), (83.0, "1:23"), (3600.0, "1:00:00"), (-1.0, "0:00")]
)
def test_the_clock_reads_like_a_clock(seconds, text):
    assert clock_text(seconds) == text


FRAME = np.zeros((480, 640, 3), np.uint8)


@pytest.mark.parametrize(
    ("frame", "pictures", "named"),
    [
        (FRAME[:, :, 0], {}, "frame"),
        (np.zeros((480, 640, 4), np.uint8), {}, "frame"),
        (FRAME[:100, :100], {}, "frame"),
        (FRAME.astype(float), {}, "float64"),
        (FRAME, {"object:a": FRAME[:4, :4]}, "'object:a'"),
    ],
)
def test_unusable_frames_and_pictures_are_refused(frame, pictures, named):
    with pytest.raises(FrameError, match=named):
        compose(frame, optimal(), pictures, sample.TEXTS)
