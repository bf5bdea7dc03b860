"""Tests of the layout rules: panels never overlap, stay inside the frame, and show the current row."""

import dataclasses
import itertools
import math

import hud_sample as sample
import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from hud import theme
from hud.canvas import Rect
from hud.compose import Compositor
from hud.conditions import condition
from hud.errors import FrameError
from hud.layout import margins, picture_rect, scrolled, unit_of, visible_rows
from hud.messages import KINDS, message
from hud.state import BinEntry, ChecklistItem, HudState, InventorySlot, Message, MessageKind, MiniMap, Pointer
from hud.task import Alternative
from hud.text import Typeface

FRAMES = ((640, 480), (1280, 720), (1920, 1080), (320, 240), (800, 600), (480, 640), (2560, 1080), (641, 479))

labels = st.one_of(
    st.text(max_size=40),
    st.sampled_from(["Blue mug", "Set of very long wooden building blocks", "W" * 60, "ÄÖÅ ñ", ""]),
)
pictures = st.sampled_from([None, "object:Novel", "missing"])


points = st.tuples(st.floats(-30.0, 30.0), st.floats(-30.0, 30.0))
minimaps = st.builds(
    MiniMap,
    st.just("missing"),
    st.tuples(st.just(0.0), st.just(0.0), st.floats(1.0, 20.0), st.floats(1.0, 20.0)),
    points,
    st.floats(-math.pi, math.pi),
    st.lists(points, max_size=3).map(tuple),
    st.lists(points, max_size=3).map(tuple),
    st.one_of(st.none(), points),
)


@st.composite
def states(draw):
    count = draw(st.integers(0, 48))
    numbered = draw(st.booleans())
    current = draw(st.integers(-1, count - 1))
    items = tuple(
        ChecklistItem(
            draw(labels),
            draw(labels),
            "object:Novel",
            draw(pictures),
            i + 1 if numbered else None,
            i < current,
            i == current,
        )
        for i in range(count)
    )
    bins = tuple(
        BinEntry(draw(labels), draw(labels), draw(pictures)) for _ in range(draw(st.integers(0, 12)))
    )
    text = draw(st.one_of(labels, st.text(min_size=50, max_size=200)))
    return HudState(
        checklist_title=draw(labels),
        checklist=items,
        bins=bins,
        inventory=(InventorySlot(draw(labels), draw(pictures)), InventorySlot()),
        message=draw(st.one_of(st.none(), st.builds(Message, st.just(text), st.sampled_from(MessageKind)))),
        delivered=draw(st.integers(0, 40)),
        total=draw(st.integers(0, 40)),
        clock=draw(st.one_of(st.none(), st.floats(0.0, 1e5))),
        pointer=draw(st.one_of(st.none(), st.builds(Pointer, st.floats(-math.pi, math.pi)))),
        minimap=draw(st.one_of(st.none(), minimaps)),
        scroll=draw(st.sampled_from((0, 0, -1000, -3, 1, 7, 1000))),
    )


def overlap(a, b):
    return a.x < b.right and b.x < a.right and a.y < b.bottom and b.y < a.bottom


def layout(state, size, *, beside=False):
    return Compositor({}, sample.TEXTS, beside=beside).layout(state, *size)


@pytest.mark.slow
@settings(max_examples=60, deadline=None, phases=[Phase.explicit, Phase.reuse, Phase.generate])
@given(states(), st.sampled_from(FRAMES))
def test_panels_are_disjoint_inside_the_frame_and_leave_the_view_free(state, size):
    found = layout(state, size)
    panels = found.panels
    for name, rect in panels.items():
        assert rect.x >= 0 and rect.y >= 0 and rect.right <= size[0] and rect.bottom <= size[1], name
        assert rect.width > 0 and rect.height > 0, name
    for (a, left), (b, right) in itertools.combinations(panels.items(), 2):
        assert not overlap(left, right), f"{a} {left} overlaps {b} {right}"
    # Shares of the frame: list 0.3 x 0.78, bins and map 0.25 x 0.89, message 0.37 x 0.13, hands 0.47 x 0.09.
    covered = sum(r.width * r.height for r in panels.values())
    assert covered <= 0.55 * size[0] * size[1], "even with twelve bins, a map and a long message"
    assert found.free.width * found.free.height >= 0.28 * size[0] * size[1], "between the lists all is free"
    assert not any(overlap(found.free, rect) for name, rect in panels.items() if name != "pointer")
    if "checklist" in panels:
        assert panels["checklist"].width <= 0.3 * size[0]
    centre = Rect(size[0] // 2 - 1, size[1] // 2 - 1, 2, 2)
    assert not any(overlap(centre, rect) for name, rect in panels.items()), "what the person looks at is free"


BESIDE = {"checklist", "bins", "progress", "clock", "inventory", "minimap"}  # never over the picture


@settings(max_examples=40, deadline=None)
@given(states(), st.integers(312, 1200), st.floats(1.0, 2.4))
def test_lists_lie_beside_a_picture_with_margins(state, height, aspect):
    width = max(416, round(height * aspect))
    top, below, left, right = margins(width, height)
    found = layout(state, (left + width + right, top + height + below), beside=True)
    picture = Rect(left, top, width, height)
    for name in BESIDE & found.panels.keys():
        assert not overlap(found.panels[name], picture), name


@settings(max_examples=40, deadline=None)
@given(states(), st.integers(360, 1200), st.floats(1.5, 2.4))
def test_panels_of_a_wide_frame_cover_nothing_but_its_border(state, height, aspect):
    width = max(640, round(height * aspect))
    picture, found = picture_rect(width, height), layout(state, (width, height), beside=True)
    for (a, one), (b, other) in itertools.combinations(found.panels.items(), 2):
        assert not overlap(one, other) or "pointer" in (a, b), f"{a} overlaps {b}"
    for name in BESIDE & found.panels.keys():
        assert not overlap(found.panels[name], picture), name


@pytest.mark.parametrize("size", [(640, 360), (960, 540), (1280, 720), (1920, 1080)])
@pytest.mark.parametrize("name", ["none", "highlight", "optimal", "guided"])
def test_a_film_of_16_to_9_shows_a_view_of_4_to_3_and_reads_whole_at_the_hardest_level(name, size):
    task = sample.task(24, steps=21, message=message("hands_full", sample.TEXTS))
    found, picture = layout(condition(name)(task), size, beside=True), picture_rect(*size)
    assert picture.width / picture.height == pytest.approx(4 / 3, abs=0.01)
    assert picture.width * picture.height >= 0.55 * size[0] * size[1]
    panels = [rect for key, rect in found.panels.items() if key != "pointer"]
    assert sum(r.width * r.height for r in panels) <= 0.25 * size[0] * size[1]
    lines = [line for row in (*found.rows, *found.bin_rows) for line in row.detail]
    assert lines and not any("…" in line for line in lines)


def test_small_and_narrow_frames_have_their_panels_over_the_picture():
    assert (
        picture_rect(640, 480) is None and picture_rect(480, 800) is None and picture_rect(480, 270) is None
    )


@pytest.mark.parametrize("base", ["highlight", "optimal"])
@pytest.mark.parametrize("steps", [0, 1, 2, 13, 30])
def test_the_metres_of_alternatives_are_never_cut_off(base, steps):
    view = sample.task(24, steps=steps)
    kinds = {"loose": "pick", "carried": "place"}
    alternatives = tuple(
        Alternative(kinds[o.status], o.name, 10.0 + i / 2, at_least=i % 2 == 0)
        for i, o in enumerate(view.objects)
        if o.status in kinds
    )
    state = condition(f"{base}-regret")(dataclasses.replace(view, alternatives=lambda: alternatives))
    for size in ((640, 480), (1280, 720), (320, 240)):
        found = layout(state, size)
        shown = zip(state.checklist[found.first : found.stop], found.rows, strict=True)
        for item, row in shown:
            text = " ".join(row.detail)
            assert "…" not in text and (" m" in item.detail) == (" m" in text)
            assert "m" not in row.detail, "a unit stays with its number"
        assert found.stop - found.first >= 5


@pytest.mark.parametrize("gap", [" ", "."])
@pytest.mark.parametrize("face", [theme.DETAIL, theme.TITLE, theme.ITEM_CURRENT])
def test_words_and_decimals_are_apart_in_the_smallest_frame(face, gap):
    typeface = Typeface(unit_of(*theme.MIN_FRAME))
    columns = [typeface.rasterise(text, face)[0].max(axis=0) > 60 for text in ("22", f"2{gap}2")]
    together, apart = (np.flatnonzero(inked) for inked in columns)
    assert np.ptp(apart) >= np.ptp(together) + 2
    assert typeface.width(f"2{gap}2", face) >= np.ptp(apart)


@settings(max_examples=50, deadline=None)
@given(states(), st.sampled_from(FRAMES))
def test_the_current_row_is_shown_and_texts_stay_in_their_rows(state, size):
    found = layout(state, size)
    typeface = Typeface(unit_of(*size))
    current = [i for i, item in enumerate(state.checklist) if item.current and not state.scroll]
    assert all(found.first <= i < found.stop for i in current)
    assert len(found.rows) == found.stop - found.first
    assert ("checklist" not in found.panels) is (not state.checklist)
    for row in found.rows:
        for line in row.detail:
            assert typeface.width(line, theme.DETAIL) <= row.text_width
    for line in found.message_lines:
        assert typeface.width(line, theme.BAR) <= found.panels["message"].width


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(states(), st.sampled_from(FRAMES[:2]))
def test_every_state_can_be_drawn_and_changes_only_its_panels(state, size):
    frame = sample.backdrop(*size)
    compositor = Compositor(sample.pictures(48), sample.TEXTS)
    outside = np.ones(frame.shape[:2], dtype=bool)
    for rect in compositor.layout(state, *size).panels.values():
        outside[rect.y : rect.bottom, rect.x : rect.right] = False
    drawn = compositor.compose(frame, state)
    assert np.array_equal(drawn[outside], frame[outside])


@given(st.lists(st.integers(1, 40), min_size=1, max_size=60), st.data())
def test_a_window_holds_the_current_row_and_wastes_no_room(heights, data):
    current = data.draw(st.integers(0, len(heights) - 1))
    room = data.draw(st.integers(40, 400))
    first, stop = visible_rows(heights, current, room)
    used = sum(heights[first:stop])
    assert 0 <= first <= current < stop <= len(heights)
    assert used <= room
    assert stop == len(heights) or used + heights[stop] > room
    if sum(heights) <= room:
        assert (first, stop) == (0, len(heights))


@given(st.lists(st.integers(1, 40), min_size=1, max_size=60), st.integers(40, 400))
def test_every_row_can_be_scrolled_to_and_no_room_is_wasted(heights, room):
    shown = [scrolled(heights, first, room) for first in range(-5, len(heights) + 5)]
    assert {i for first, stop in shown for i in range(first, stop)} == set(range(len(heights)))
    for (first, stop), (later, _) in itertools.pairwise(shown):
        assert 0 <= first <= later and stop <= len(heights)
        assert sum(heights[first:stop]) <= room
        assert stop == len(heights) or sum(heights[first : stop + 1]) > room
    first, stop = shown[-1]
    assert stop == len(heights) and (first == 0 or sum(heights[first - 1 :]) > room)


def test_a_list_of_48_steps_can_be_read_whole_and_is_never_cut():
    view = sample.task(24, steps=21)
    read = set()
    for scroll in range(-48, 49):
        state = condition("optimal")(dataclasses.replace(view, scroll=scroll))
        found = layout(state, (640, 480))
        read |= set(range(found.first, found.stop))
        assert not any("…" in line for row in found.rows for line in row.detail)
    assert read == set(range(48))


@pytest.mark.parametrize(("size", "share"), [((640, 480), 0.49), ((1280, 720), 0.42), ((1920, 1080), 0.42)])
@pytest.mark.parametrize("name", ["none", "highlight", "optimal"])
def test_the_view_stays_mostly_free_and_no_text_is_cut_at_the_hardest_level(name, size, share):
    found = layout(
        condition(name)(sample.task(24, steps=21, message=message("hands_full", sample.TEXTS))), size
    )
    assert sum(r.width * r.height for r in found.panels.values()) <= share * size[0] * size[1]
    lines = [line for row in (*found.rows, *found.bin_rows) for line in row.detail]
    assert lines and not any("…" in line for line in lines)


@pytest.mark.parametrize("key", sorted(KINDS))
@pytest.mark.parametrize("size", FRAMES[:3])
def test_messages_are_never_cut(key, size):
    bar = message(key, sample.TEXTS, object="Stack of picture books", receptacle="Office-supply box")
    state = HudState("", (), condition("none")(sample.task(6)).bins, (InventorySlot(), InventorySlot()), bar)
    assert " ".join(layout(state, size).message_lines) == bar.text


def test_a_frame_too_small_to_read_is_refused():
    with pytest.raises(FrameError, match="319 x 240"):
        layout(condition("none")(sample.task(6)), (319, 240))
