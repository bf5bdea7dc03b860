"""The contact sheet holds every frame where its captions say; the levels are those of one house."""

import itertools

import cv2
import numpy as np
import pytest

from experiments.cli.main import main
from experiments.trials.floor_plan import PLANNED, house_picture
from tools.gallery import SITUATIONS, contact_sheet


@pytest.mark.slow
def test_the_four_levels_are_one_house_and_the_first_has_its_way(house, tmp_path):
    """Objects cover ever more of the house, which is the same; the dashed way is in the first picture alone."""
    assert main(["gallery", "levels", "--out", str(tmp_path)]) == 0
    sheet = cv2.cvtColor(cv2.imread(str(tmp_path / "levels.png")), cv2.COLOR_BGR2RGB)
    panels = [half for row in np.split(sheet, 2) for half in np.split(row, 2, axis=1)]
    tidy = house_picture(house, 90)
    inside = [panel[28 : 28 + len(tidy), 28 : 28 + tidy.shape[1]] for panel in panels]
    way = np.array(list(bytes.fromhex(PLANNED[1:])))
    dashes = [int((picture == way).all(axis=2).sum()) for picture in inside]
    assert dashes[0] > 500 and dashes[1:] == [0, 0, 0]
    changed = [np.abs(picture.astype(int) - tidy).max(axis=2) > 8 for picture in inside]
    assert all(mask.mean() < 0.1 for mask in changed), "the same house"
    for fewer, more in itertools.pairwise(changed[1:]):
        assert fewer.sum() < more.sum()
    assert main(["gallery", "levels", "--out", str(tmp_path)]) == 2, "what exists is kept"


def test_every_frame_is_on_the_sheet_in_its_row_and_column():
    conditions = ("none", "highlight")
    colours = {
        (name, key): np.array([40 * row + 20, 50 * column + 30, 200], np.uint8)
        for row, name in enumerate(conditions)
        for column, key in enumerate(SITUATIONS)
    }
    frames = {which: np.full((540, 960, 3), colour, np.uint8) for which, colour in colours.items()}
    sheet = contact_sheet(conditions, frames, width=160)
    corners = {}
    for which, colour in colours.items():
        rows, columns = np.nonzero((sheet == colour).all(axis=2))
        assert len(rows) == 160 * 90, which
        assert (np.ptp(rows), np.ptp(columns)) == (89, 159)
        corners[which] = rows.min(), columns.min()
    for name in conditions:
        lefts = [corners[name, key][1] for key in SITUATIONS]
        assert lefts == sorted(set(lefts))
        assert {corners[name, key][0] for key in SITUATIONS} == {corners[name, "start"][0]}
    assert corners["none", "start"][0] < corners["highlight", "start"][0]
    captions = sheet[: corners["none", "start"][0]]
    assert (captions < 100).all(axis=2).sum() > 100, "situations are named above"
