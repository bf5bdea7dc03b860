"""The contact sheet holds every frame where its captions say."""

import numpy as np

from tools.gallery import SITUATIONS, contact_sheet


def test_every_frame_is_on_the_sheet_in_its_row_and_column():
    conditions = ("none", "highlight")
    colours = {
        (name, key): np.array([40 * row + 20, 50 * column + 30, 200], np.uint8)
        for row, name in enumerate(conditions)
        for column, key in enumerate(SITUATIONS)
    }
    frames = {which: np.full((480, 640, 3), colour, np.uint8) for which, colour in colours.items()}
    sheet = contact_sheet(conditions, frames, width=160)
    corners = {}
    for which, colour in colours.items():
        rows, columns = np.nonzero((sheet == colour).all(axis=2))
        assert len(rows) == 160 * 120, which
        assert (np.ptp(rows), np.ptp(columns)) == (119, 159)
        corners[which] = rows.min(), columns.min()
    for name in conditions:
        lefts = [corners[name, key][1] for key in SITUATIONS]
        assert lefts == sorted(set(lefts))
        assert {corners[name, key][0] for key in SITUATIONS} == {corners[name, "start"][0]}
    assert corners["none", "start"][0] < corners["highlight", "start"][0]
    captions = sheet[: corners["none", "start"][0]]
    assert (captions < 100).all(axis=2).sum() > 100, "situations are named above"
